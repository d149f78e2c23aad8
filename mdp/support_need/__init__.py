"""Support need: which faces that overhang cannot do without support along a direction, one definition for search and slicer."""
