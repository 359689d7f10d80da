"""How long a test waits for what always comes, on however slow and busy a machine."""

from __future__ import annotations

PATIENCE = 900.0
"""What never ends is given up after so long, so that the test that waits is named [s].

It says nothing of how fast anything is: each of these waits is over in seconds.
"""
