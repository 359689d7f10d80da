"""Tool poses and speeds in, a verified C² joint trajectory out."""
