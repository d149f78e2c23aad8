"""Landmarks: the comments that tell where layers and parts begin; the dry run, the sender and the journal read them alike."""

import re

LAYER = re.compile(r"LAYER_CHANGE|LAYER:-?[0-9]{1,6}")  # PrusaSlicer's word and ours, Cura's
PART = re.compile(r"PART: *([0-9]{1,6})(?: of ([0-9]{1,6}))?.*")


def begins_layer(comment: str) -> bool:
    """Whether a comment, its sign and the blanks around it taken off, begins a layer."""
    return LAYER.fullmatch(comment) is not None


def begun_part(comment: str) -> tuple[int, int] | None:
    """The part that such a comment begins, from 1, and of how many, 0 where it does not tell; None for another comment."""
    match = PART.fullmatch(comment)
    return (int(match[1]), int(match[2] or 0)) if match else None
