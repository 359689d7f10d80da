"""Solutions of a pose: the nearest, all of them, and one for each of many poses."""
