"""Fill: division of a layer into skin and sparse areas, and the beads of skins and sparse infill."""
