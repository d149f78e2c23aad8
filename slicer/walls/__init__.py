"""Walls: closed beads along the outline, what is too narrow for them, and where they begin.

Public: `layer_walls.layer_walls` makes a layer's walls of its section, `walls.wall_beads` beads of them, `gap.gaps` fills what
other beads leave; `seam_plan.plan_seams` finds where seams are hidden, `seam.place_seams` begins walls there;
`overhang.split_overhangs`, `brim.brim`.
"""
