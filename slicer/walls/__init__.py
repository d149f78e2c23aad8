"""Walls: closed beads along the outline, as wide as the place, and what fills the places that other beads leave."""
