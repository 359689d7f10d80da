"""Arms with solutions by geometry: configuration flags, and the closed form."""
