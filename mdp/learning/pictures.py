"""Figures of the 2020 paper: J and time against beam width (Fig. 7), importance and correlation of features (Fig. 8)."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mdp.learning.widths import Comparison
from mdp.mesh import Floats
from profiles.errors import UserError

INCHES, DOTS = 4.2, 150  # size of a panel, resolution per inch
DARK = 0.6  # correlation above which a square is too dark for black figures
PLAIN, LEARNED = "#4472a8", "#e0a030"


def draw_widths(comparisons: Sequence[Comparison]) -> Figure:
    """One row per comparison: reduction of the mean J relative to the narrowest plain beam, and processor time, for each
    width.
    """
    figure = Figure(figsize=(2 * INCHES, INCHES * len(comparisons)), layout="constrained")
    for comparison, (left, right) in zip(comparisons, figure.subplots(len(comparisons), 2, squeeze=False), strict=True):
        first = float(next(iter(comparison.shares.values())).mean())
        rankers = list(dict.fromkeys(ranker for ranker, _ in comparison.shares))
        for colour, ranker in zip(_colours(len(rankers)), rankers, strict=True):
            widths = [width for name, width in comparison.shares if name == ranker]
            means = [float(comparison.shares[ranker, width].mean()) for width in widths]
            less = [100.0 * (1.0 - mean / first) if first > 0.0 else 0.0 for mean in means]
            left.plot(widths, less, "o-", color=colour, label=ranker)
            right.plot(widths, [comparison.core_s[ranker, width].mean() for width in widths], "o-", color=colour)
        for axes, label in ((left, "mean J less than the first one, %"), (right, "processor time a model, s")):
            _name_widths(axes, sorted({width for _, width in comparison.shares}))
            axes.set_ylabel(label)
        left.legend()
        left.set_title(f"{comparison.method}, {len(comparison.models)} models", fontsize="medium")
        right.set_title(comparison.settings or "default settings", fontsize="x-small", wrap=True)
    return figure


def _name_widths(axes: Axes, widths: Sequence[int]) -> None:
    axes.set_xscale("log")
    axes.set_xticks(widths, [str(width) for width in widths])
    axes.minorticks_off()
    axes.set_xlabel("beam width")
    axes.grid(alpha=0.3)


def _colours(count: int) -> list[str]:
    return [PLAIN, LEARNED, *(f"C{number}" for number in range(2, count))][:count]


def draw_features(columns: Sequence[str], importance: Floats, correlation: Floats) -> Figure:
    """Bars of (k,) importance beside the (k, k) correlation matrix."""
    side = max(INCHES, 0.42 * len(columns))
    figure = Figure(figsize=(2 * side, side), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.barh(columns, importance, color=PLAIN)
    left.invert_yaxis()
    left.set_xlabel("permutation importance: NDCG@5 lost")
    right.imshow(correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    right.set_xticks(range(len(columns)), columns, rotation=90 if len(columns) > 6 else 0)
    right.set_yticks(range(len(columns)), columns)
    right.set_title("Pearson correlation", fontsize="medium")
    for row, values in enumerate(correlation):
        for column, value in enumerate(values):
            right.text(
                column, row, f"{value:.2f}", ha="center", va="center", fontsize="x-small", color="w" if abs(value) > DARK else "k"
            )
    return figure


def save(figure: Figure, file: Path) -> None:
    """Write a figure as PNG; raises UserError if that fails."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(file, dpi=DOTS, format="png", metadata={"Software": None})
    except OSError as error:
        raise UserError(f"picture {file} cannot be written ({error.strerror})") from None
