"""Cost: what a person pays for a decomposition, in mm2 of blemished surface, whole and by the face."""
