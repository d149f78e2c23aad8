"""Walls: closed beads along the outline, as wide as the section there, and fill for gaps between beads."""
