"""Configurations of other slicers as material and process profiles: PrusaSlicer, SuperSlicer, OrcaSlicer, Bambu Studio, Cura."""
