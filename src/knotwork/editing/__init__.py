"""A task edited by hand: its text with undo, and where its parts are grasped in the scene."""
