"""Lying: how a model is best laid down, in words."""

from machine.view.quantities import minutes
from mdp.decomposition import Decomposition
from mdp.directions.orientation import Orientation, in_words, side_in_words
from mdp.search.laying import OtherWay


def laid_in_words(chosen: Orientation | None) -> str:
    """What has become of a model that was to be laid down; None: it stays."""
    return "the model is best printed as it stands" if chosen is None else f"the model is {in_words(chosen)}"


def better_in_words(decomposition: Decomposition, better: OtherWay | None) -> str:
    """What costs much less than these parts, and how much; "" where nothing does."""
    chosen = decomposition.chosen
    if better is None or chosen is None:
        return ""
    side = side_in_words(better.orientation)
    lying = f"{side} ({in_words(better.orientation)})" if side else in_words(better.orientation)
    figures = [f"leaves {better.row.cost_mm2:.0f} mm2 of scars instead of {chosen.cost_mm2:.0f}"]
    if better.row.time_s is not None and chosen.time_s is not None:
        figures.append(f"takes {minutes(better.row.time_s)} instead of {minutes(chosen.time_s)}")
    return f"{lying} in one piece it {' and '.join(figures)}"
