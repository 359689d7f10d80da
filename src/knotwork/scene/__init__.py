"""What may collide: bodies of robot, tool and surroundings, and the pairs that are checked.

Coal measures distances. It comes with Pinocchio, and is loaded where a collision model is made.
"""
