"""Directions: evenly spread unit vectors, frames across them, and orientations in which a model rests.

`unit_vectors.spread`, `unit_vectors.frame_across`, `orientation.best_orientation`.
"""
