"""Sweep: all offsets of one direction evaluated in one pass over the faces.

`sweep.gains` computes the savings of each plane, `sweep.sweep` its feasibility; both take a `sweep.Remainder`, the solid prepared
once.
"""
