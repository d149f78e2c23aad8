"""Layers: beads over sparse infill or support are not reported; a layer without beads is, whatever is above it."""

import re
from functools import cache

import manifold3d as m3
import pytest

from machine.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.decomposition import Decomposition
from profiles.profile import Profile, load
from slicer.slice import slice_parts
from tests.machine.dryrun.planted import layers_of, word
from tests.shapes import standing
from tests.slicer.hand import whole

SETTINGS = [
    *((f"process.infill_pattern={pattern}",) for pattern in ("grid", "rectilinear", "triangles", "cubic", "gyroid", "honeycomb")),
    ("process.infill_pattern=lightning",),
    *((f"process.infill_density={density}",) for density in (0.0, 0.05, 0.45, 1.0)),
    ("process.walls=1",), ("process.walls=0",), ("process.layer_height_mm=0.3",), ("process.top_layers=1",),
]  # fmt: skip


# a grid, lightning, and the sparsest and the densest infill
TELLING = [SETTINGS[0], SETTINGS[6], SETTINGS[8], SETTINGS[10]]


@cache
def stepped(settings: tuple[str, ...]) -> tuple[Profile, tuple[str, ...]]:
    """A plate with a pocket and a table on it: floors over infill, walls that begin on a floor, a slot, a roof on support."""
    plate, pocket = m3.Manifold.cube((36, 16, 5)), m3.Manifold.cube((14, 10, 5)).translate((4, 3, 2.4))
    slot = m3.Manifold.cube((10, 30, 0.2)).translate((22, -5, 3.2))
    stem, roof = m3.Manifold.cube((8, 8, 5)).translate((22, 4, 4)), m3.Manifold.cube((34, 12, 2)).translate((1, 2, 9))
    part = whole(standing(plate - pocket - slot + stem + roof))
    profile = load(settings=settings)
    sliced = slice_parts([part], profile)
    program = plan(Decomposition("stepped", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0), sliced, profile)
    return profile, tuple(write_gcode(program, profile))


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda settings: settings[0])
def test_a_sound_print_has_no_finding_whatever_it_bridges(settings: tuple[str, ...]) -> None:
    profile, lines = stepped(settings)
    run = dry_run(lines, profile)
    assert [f.message for f in run.errors] == []
    assert not {"air", "gap"} & {f.code for f in run.findings}


def test_a_roof_far_above_everything_below_it_is_found_although_it_is_a_bridge() -> None:
    part = whole(standing(m3.Manifold.cube((20, 20, 10))))
    profile = load(settings=("process.walls=0", "process.infill_density=0"))
    decomposition = Decomposition("", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    program = plan(decomposition, slice_parts([part], profile), profile)
    (error,) = dry_run(write_gcode(program, profile), profile).errors
    assert "layer 5 begins 8.40 mm above all that lies below" in error.message


@pytest.mark.parametrize("gap_mm", [0.2, 0.6, 1.25, 2.0])
def test_a_bridge_on_support_is_sound_however_large_the_gap_between_them(gap_mm: float) -> None:
    block, plate = m3.Manifold.cube((8, 8, 4)), m3.Manifold.cube((20, 20, 3)).translate((0, 0, 8))
    part, profile = whole(standing(block + plate)), load(settings=(f"process.support_gap_mm={gap_mm}", "process.support=auto"))
    decomposition = Decomposition("", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    program = plan(decomposition, slice_parts([part], profile), profile)
    assert "gap" not in {finding.code for finding in dry_run(write_gcode(program, profile), profile).findings}


@pytest.mark.parametrize("settings", TELLING, ids=lambda settings: settings[0])
@pytest.mark.parametrize("layer", range(3, 24, 4))
def test_a_layer_without_its_beads_is_found_at_the_next_layer(settings: tuple[str, ...], layer: int) -> None:
    profile, lines = stepped(settings)
    gone = layers_of(list(lines), 1)[layer - 1]
    edited = [line for k, line in enumerate(lines) if k not in gone or not re.match("G1 .*E", line)]
    assert (layer + 1) in {f.layer for f in dry_run(edited, profile).errors if f.code == "gap"}


@pytest.mark.parametrize("layer", [20, 40])
@pytest.mark.parametrize("rise_mm", [0.1, -0.1])
def test_a_layer_at_the_wrong_height_is_found_although_support_is_printed_before_the_part(layer: int, rise_mm: float) -> None:
    profile, lines = stepped(("process.support_least_mm2=2",))
    moved = layers_of(list(lines), 1)[layer - 1]
    assert any(";TYPE:Support material" in lines[k] for k in moved)
    edited = [word("Z", lambda z: z + rise_mm)(line) if k in moved else line for k, line in enumerate(lines)]
    assert {layer, layer + 1} & {f.layer for f in dry_run(edited, profile).errors if f.code == "gap"}


@pytest.mark.parametrize(("length_mm", "codes"), [(0.8, set()), (5.0, {"gap"})])
def test_a_crumb_on_top_of_a_part_is_no_missing_layer(length_mm: float, codes: set[str]) -> None:
    begin = "G28\nM109 S210\nM83\n;PART:1 of 1\n;LAYER_CHANGE\n;TYPE:Perimeter\n;WIDTH:0.45\n;HEIGHT:0.2\nG0 Z0.2 F600\nG0 X-20"
    crumb = f";LAYER_CHANGE\nG0 Z0.6\nG0 X0\nG1 X{length_mm} E{0.034 * length_mm:.4f}"
    found = dry_run(f"{begin}\nG1 X20 E1.36 F600\n{crumb}\nM104 S0".splitlines(), load()).errors
    assert {f.code for f in found if f.code == "gap"} == codes


@pytest.mark.parametrize(("y_mm", "codes"), [(5.0, set()), (0.0, {"gap"})])
def test_a_layer_on_support_as_high_as_the_part_is_not_reported_as_a_gap(y_mm: float, codes: set[str]) -> None:
    lines = ["G28", "M109 S210", "M83", ";PART:1 of 1", ";WIDTH:0.45", ";HEIGHT:0.2", "G0 Z0.2 F600"]
    for z_mm in (0.2, 0.4):
        for kind, y in (("Perimeter", 0.0), ("Support material interface", 5.0)):
            lines += [";LAYER_CHANGE"] if y == 0.0 else []
            lines += [f";TYPE:{kind}", f"G0 Z{z_mm}", f"G0 X-20 Y{y}", "G1 X20 E1.36 F600"]
    lines += [";LAYER_CHANGE", ";TYPE:Perimeter", "G0 Z0.8", f"G0 X-20 Y{y_mm}", "G1 X20 E1.36", "M104 S0"]
    assert {f.code for f in dry_run(lines, load()).errors if f.code == "gap"} == codes
