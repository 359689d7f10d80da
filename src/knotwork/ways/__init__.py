"""Ways round obstacles: motions between two states that are C2, cubic and proved clear."""
