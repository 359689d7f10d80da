"""The arm along a tool path: its joints by continuation, and the waypoints that hold them to it."""
