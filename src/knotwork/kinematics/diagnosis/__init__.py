"""Why a pose has no solution, and how close the arm comes to it."""
