"""Draw the pictures of docs/tour.md: `python tools/docs/draw_tour.py` writes one for each value to docs/tour.

The model is demo:tree on the machine generic_ac with default settings. Needs the extra `train` for matplotlib.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from machine.dryrun.dryrun import DryRun, dry_run
from machine.gcode.writer import write_gcode
from machine.pipeline.choice import pricing
from machine.pipeline.pictures import parts_picture, write_png
from machine.planning.plan import plan
from mdp.mesh import Floats
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.search.search import SearchRequest, decompose
from profiles.machine import Machine
from profiles.profile import load
from slicer.paths import Layer
from slicer.slice import slice_parts
from tools.docs.harness import DOCS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OUT = DOCS / "tour"
MODEL = "demo:tree"
LAYER = 40  # of the first part
EXCERPT = 21  # lines of G-code around the first change of parts
WIDTH, HEIGHT = 640, 320


def main() -> None:
    """Process the model, and draw each value."""
    profile = load()
    mesh, _ = read_mesh(locate(MODEL))
    decomposition = decompose(mesh, MODEL, profile, SearchRequest(price=pricing(profile)))
    sliced = slice_parts(decomposition.parts, profile)
    program = plan(decomposition, sliced, profile)
    lines = write_gcode(program, profile)
    run = dry_run(lines, profile)
    save("machine", head_over_table, profile.machine)
    both = parts_picture(decomposition, profile, (2 * WIDTH, HEIGHT))
    write_png(OUT / "mesh.png", both[:, :WIDTH])
    write_png(OUT / "parts.png", both[:, WIDTH:])
    save("layer", strokes_by_kind, sliced[0].layers[LAYER])
    save("moves", axes_over_time, run)
    save("gcode", change_of_parts, lines)
    save("plastic", beads_by_part, run)


def save(name: str, show: Callable[..., None], *values: object) -> None:
    """Save one picture, drawn by a function of some values."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    show(figure.subplots(), *values)
    figure.savefig(OUT / f"{name}.png", dpi=100, metadata={"Software": None})


def head_over_table(axes: "Axes", machine: Machine) -> None:
    """The head's silhouette over the tilted table, seen along the tilt axis."""
    radius, height = np.array(machine.head.silhouette_mm).T
    outline = np.column_stack([np.concatenate([-radius[::-1], radius]), np.concatenate([height[::-1], height])])
    axes.fill(
        *np.vstack([outline, [(radius[-1], 90.0), (-radius[-1], 90.0)]]).T, color="#9aa0a8", label="head, by its silhouette"
    )
    for tilt_deg, colour in ((0.0, "#0072b2"), (45.0, "#d55e00")):
        turn = np.radians(tilt_deg)
        ends = np.array([-60.0, 60.0])
        shift = 60.0 * np.sin(turn)
        axes.plot(ends * np.cos(turn), ends * np.sin(turn) - shift, color=colour, linewidth=4, label=f"table at {tilt_deg:g} deg")
    axes.set(aspect="equal", xlabel="mm", ylabel="mm above the tip", xlim=(-140, 140))
    axes.legend(loc="upper right", fontsize=8)


def strokes_by_kind(axes: "Axes", layer: Layer) -> None:
    """The strokes of a layer, coloured by kind."""
    kinds = dict.fromkeys(path.kind for path in layer.paths)
    add_lines(axes, 1.2, ([path.points for path in layer.paths if path.kind == kind] for kind in kinds), [*kinds])
    axes.set(xlabel="x, mm", ylabel="y, mm", title=f"{len(layer)} strokes at z = {layer.z_mm:.2f} mm")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)


def add_lines(axes: "Axes", width: float, groups: Iterable[Sequence[Floats]], names: Sequence[str]) -> None:
    """Lines in one colour for each group, at one scale of both axes."""
    from matplotlib.collections import LineCollection

    for number, (lines, name) in enumerate(zip(groups, names, strict=True)):
        axes.add_collection(LineCollection(lines, colors=f"C{number}", linewidths=width, label=name))
    axes.autoscale()
    axes.set(aspect="equal")


def axes_over_time(axes: "Axes", run: DryRun) -> None:
    """Positions of the machine's axes during the print."""
    minutes = np.cumsum(run.times_s) / 60.0
    for k, letter in enumerate(run.letters):
        axes.plot(minutes, run.program.end[:, k], linewidth=0.8, label=letter)
    axes.set(xlabel="minutes", ylabel="mm, deg")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)


def change_of_parts(axes: "Axes", lines: Sequence[str]) -> None:
    """The lines around the first change from one part to the next."""
    at = next((k for k, line in enumerate(lines) if line.startswith(";PART:2")), len(lines) // 2)
    text = "\n".join(line[:90] for line in lines[at - EXCERPT // 3 : at + 2 * EXCERPT // 3])
    axes.text(0.0, 1.0, text, family="monospace", fontsize=8, verticalalignment="top", transform=axes.transAxes)
    axes.set_axis_off()


def beads_by_part(axes: "Axes", run: DryRun) -> None:
    """The plastic in the workpiece frame, seen from the front, coloured by part."""
    segments, part = run.deposited.segments(), run.program.part[run.segment_row]
    numbers = np.unique(part)
    add_lines(axes, 0.2, (segments[part == number][:, :, [0, 2]] for number in numbers), [f"{number}" for number in numbers])
    axes.set(xlabel="x, mm", ylabel="z, mm")


if __name__ == "__main__":
    main()
