"""Arms whose geometry gives their solutions: configuration flags, and the closed form."""
