"""The arm itself: joint axes, ranges of joints, local searches, joint velocities."""
