"""Fill: skins, sparse infill, bridges."""
