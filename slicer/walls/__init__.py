"""Walls: closed beads along the outline, what is too narrow for them, and where they begin."""
