"""Walls: closed beads along the outline, as wide as the place, and what fills the places that other beads leave.

Public: `walls.layer_walls` makes a layer's walls of its section, `walls.gaps` fills places between beads.
"""
