"""Interactive editing of a task: its text with undo, and handles in the scene."""
