"""Sweep: all offsets of one direction evaluated in one pass over the faces.

`sweep.gains` says what each plane makes safe, `sweep.sweep` whether it can be cut; both take a `sweep.Remainder`, the solid
laid out once.
"""
