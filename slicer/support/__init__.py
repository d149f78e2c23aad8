"""Support: what hangs, where support may stand, how it grows, and its beads."""
