"""The command line: the only part of Knotwork that prints."""
