"""Draw the pictures of docs/tour.md: `python tools/docs/draw_tour.py` writes one for each value to docs/tour.

The model is demo:tree on the machine generic_ac with default settings. Needs the extra `train` for matplotlib.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from machine.dryrun.dryrun import DryRun, dry_run
from machine.gcode.writer import write_gcode
from machine.pipeline.choice import pricing
from machine.pipeline.pictures import best_view, floor_of, parts_apart
from machine.pipeline.raster import draw
from machine.planning.plan import plan
from machine.view.parts import part_colours, residual_faces
from mdp.cost.cost import needing_upright
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.search.search import SearchRequest, decompose
from profiles.machine import Machine
from profiles.profile import Profile, load
from slicer.paths import Layer
from slicer.slice import slice_parts
from tools.docs.harness import DOCS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OUT = DOCS / "tour"
MODEL = "demo:tree"
LAYER = 40  # of the first part
EXCERPT = 21  # lines of G-code around the first change of parts
SIZE = (640, 320)
FLOOR, GREY = (236.0, 238.0, 241.0), (214.0, 217.0, 222.0)


def main() -> None:
    """Process the model, and draw each value."""
    OUT.mkdir(exist_ok=True)
    profile = load()
    mesh, _ = read_mesh(locate(MODEL))
    decomposition = decompose(mesh, MODEL, profile, SearchRequest(price=pricing(profile)))
    sliced = slice_parts(decomposition.parts, profile)
    program = plan(decomposition, sliced, profile)
    lines = write_gcode(program, profile)
    run = dry_run(lines, profile)
    save("machine", head_over_table, profile.machine)
    save("mesh", mesh_with_overhangs, mesh, profile)
    save("parts", parts_moved_apart, decomposition, profile)
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


def mesh_with_overhangs(axes: "Axes", mesh: Mesh, profile: Profile) -> None:
    """The model, with faces that need support upright in red."""
    risky = needing_upright(mesh, profile)
    axes.imshow(draw([floor_of(mesh), mesh], [FLOOR, GREY], reds=[None, risky], axes=best_view(mesh, risky), size=SIZE))
    axes.set_axis_off()


def parts_moved_apart(axes: "Axes", decomposition: Decomposition, profile: Profile) -> None:
    """The parts moved apart, with faces that still need support in red."""
    mesh, parts = decomposition.mesh, decomposition.parts
    reds = [residual_faces(part, profile) for part in parts]
    view = best_view(mesh, needing_upright(mesh, profile))
    colours = [FLOOR, *part_colours(len(parts))]
    axes.imshow(draw([floor_of(mesh), *parts_apart(parts)], colours, reds=[None, *reds], axes=view, size=SIZE))
    axes.set_axis_off()


def strokes_by_kind(axes: "Axes", layer: Layer) -> None:
    """The strokes of a layer, coloured by kind."""
    from matplotlib.collections import LineCollection

    for colour, kind in enumerate(dict.fromkeys(path.kind for path in layer.paths)):
        paths = [path for path in layer.paths if path.kind == kind]
        lines = LineCollection([path.points for path in paths], colors=f"C{colour}", linewidths=1.2, label=kind.value)
        axes.add_collection(lines)
    axes.autoscale()
    axes.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", title=f"{len(layer)} strokes at z = {layer.z_mm:.2f} mm")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)


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
    from matplotlib.collections import LineCollection

    segments, part = run.deposited.segments(), run.program.part[run.segment_row]
    for number in np.unique(part):
        lines = LineCollection(segments[part == number][:, :, [0, 2]], colors=f"C{number}", linewidths=0.2)
        axes.add_collection(lines)
    axes.autoscale()
    axes.set(aspect="equal", xlabel="x, mm", ylabel="z, mm")


if __name__ == "__main__":
    main()
