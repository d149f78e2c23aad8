"""Walls as wide as the place: beads between the outline and its skeleton, their number and widths by how thick the place is."""
