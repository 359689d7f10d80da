"""Joint motion along a tool path by continuation, and the waypoints that its tolerances need."""
