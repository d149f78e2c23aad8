"""Fill: which places are skin and which sparse, and the beads of skins and sparse infill."""
