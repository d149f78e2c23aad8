"""Walls: closed beads along the outline, what is too narrow for them, and where they begin.

Public: `layer_walls.layer_walls` makes a layer's walls of its section, `walls.wall_beads` beads of them, `gap.gaps` fills what
other beads leave; `seam.place_seams`, `overhang.split_overhangs`, `brim.brim`.
"""
