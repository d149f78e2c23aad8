"""Foreign: settings of PrusaSlicer, SuperSlicer, OrcaSlicer, Bambu Studio and Cura converted to profiles."""
