"""Directions: spread evenly, frames across them, and those in which a model rests.

`spread.spread`, `frame.frame_across`, `orientation.best_orientation`.
"""
