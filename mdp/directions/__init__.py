"""Directions: spread evenly, frames across them, and those in which a model rests.

`unit_vectors.spread`, `unit_vectors.frame_across`, `orientation.best_orientation`.
"""
