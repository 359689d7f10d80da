"""Arms whose geometry tells their solutions: configuration flags, and the closed form."""
