"""Fill: which places are skin and which sparse, and the beads of skins, sparse infill and bridges."""
