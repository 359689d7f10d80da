"""The choice of one solution at each waypoint of a sequence."""
