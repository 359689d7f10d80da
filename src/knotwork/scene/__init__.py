"""Collision models: bodies of robot, tool and surroundings, and the checked pairs.

Coal measures distances. It comes with Pinocchio, and is loaded with the first collision model.
"""
