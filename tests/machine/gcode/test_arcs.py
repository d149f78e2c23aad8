"""Arcs: fitted to paths, written, read back and executed by the simulated printer."""

from math import cos, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from machine.dryrun import dry_run
from machine.gcode.arcs import arc_box, arc_centre, chord_count, chords, sweep_rad
from machine.gcode.reader.codes import CHORD_MM
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.writer import write_gcode
from machine.simulator.board import BuildOptions
from machine.simulator.firmware import SimulatedFirmware
from mdp.mesh import Floats
from profiles.profile import Profile, load
from slicer.paths import Kind
from tests.machine.moves import Stroke, Travel, program_of

ARCS = ("machine.arcs=true",)
HEAD = "G21\nG90\nM83\nG92 X0 Y0 Z0 E0\n"


def _turning(seed: int) -> Floats:
    """A path of straight stretches and curves of all radii, sampled finely and coarsely."""
    random = np.random.default_rng(seed)
    at, heading, points = np.zeros(2), 0.0, [np.zeros(2)]
    for _ in range(12):
        radius, turn = 10 ** random.uniform(-0.5, 1.5), random.uniform(-3, 3) * (random.random() < 0.8)
        steps = int(random.integers(1, 30))
        for _ in range(steps):
            heading += turn / steps
            at = at + abs(turn or 1.0) * radius / steps * np.array([cos(heading), sin(heading)])
            points.append(at)
    return np.array(points)


def _program(flat: Floats, profile: Profile) -> tuple[list[str], Stroke]:
    points = np.column_stack([flat, np.full(len(flat), 0.2)])
    stroke = Stroke(Kind.OUTER_WALL, points, 0.03 * np.hypot(*np.diff(flat, axis=0).T), 30.0, 0.45)
    arrive = Travel(np.array([points[0] + [0, 0, 1], points[0]]), 50.0)
    return list(write_gcode(program_of("arcs", (arrive, arrive, stroke)), profile)), stroke


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.sampled_from([0.003, 0.01, 0.025, 0.1]))
@example(40000, 0.1)  # a chord from outside to inside is nearest to the centre beside its middle
def test_fitted_arcs_read_back_keep_to_the_path_and_push_its_filament(seed: int, tolerance: float) -> None:
    profile = load(settings=[*ARCS, f"machine.arc_tolerance_mm={tolerance}"])
    flat = _turning(seed)
    lines, stroke = _program(flat, profile)
    parsed = parse_gcode(lines, profile.machine)
    laid = np.vstack([flat[:1], parsed.end[parsed.e_mm > 0, :2]])
    path, read = shapely.LineString(flat), shapely.LineString(laid)
    allowed = tolerance + CHORD_MM + 0.001
    assert shapely.hausdorff_distance(path, read, densify=0.02) <= allowed
    assert parsed.e_mm.sum() == pytest.approx(stroke.filament_mm.sum(), abs=1.1e-5)


def test_a_finely_sampled_circle_becomes_two_arcs() -> None:
    turn = np.linspace(0, 2 * pi, 181)
    lines, _ = _program(10.0 * np.column_stack([np.cos(turn), np.sin(turn)]), load(settings=ARCS))
    strokes = [line.split()[0] for line in lines if line.startswith(("G1 X", "G1 Y", "G2 ", "G3 "))]
    assert strokes == ["G3", "G3"]


def test_without_the_setting_no_arcs_are_written() -> None:
    lines, _ = _program(_turning(1), load())
    assert not [line for line in lines if line.startswith(("G2 ", "G3 "))]


def test_corners_stay_straight_moves() -> None:
    square = np.array([[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]], dtype=float)
    lines, _ = _program(square, load(settings=ARCS))
    assert len([line for line in lines if line.startswith(("G1 X", "G1 Y"))]) == 4


@pytest.mark.parametrize(
    ("line", "end", "length"),
    [
        ("G2 X10 Y0 I5 J0 E1", (10, 0), 5 * pi),
        ("G3 X10 Y0 I5 J0 E1", (10, 0), 5 * pi),
        ("G3 X10 Y10 R10 E1", (10, 10), 5 * pi),
        ("G3 X10 Y10 R-10 E1", (10, 10), 15 * pi),
        ("G2 I3 J4 E1", (0, 0), 10 * pi),
        ("G2 X10 Y0 Z2 I5 E1", (10, 0), (25 * pi**2 + 4) ** 0.5),
    ],
)
def test_an_arc_is_read_with_its_length_and_filament(line: str, end: tuple[float, float], length: float) -> None:
    parsed = parse_gcode((HEAD + line).splitlines(), load().machine)
    assert parsed.end[-1, :2] == pytest.approx(end)
    assert np.linalg.norm(parsed.end - parsed.start, axis=1).sum() == pytest.approx(length, rel=2e-3)
    assert parsed.e_mm.sum() == pytest.approx(1.0)
    assert set(parsed.line) == {5}


def test_left_and_right_arcs_bulge_to_different_sides() -> None:
    machine = load().machine
    right, left = (parse_gcode(f"{HEAD}G{k} X10 Y0 I5 J0".splitlines(), machine).end[:, 1] for k in (2, 3))
    assert right.max() == pytest.approx(5, abs=0.01)
    assert left.min() == pytest.approx(-5, abs=0.01)


@settings(max_examples=60)
@given(st.floats(0.5, 200), st.floats(-6, 6), st.floats(0.001, 0.1))
def test_chords_stay_within_their_tolerance_of_the_arc(radius: float, sweep: float, tolerance: float) -> None:
    count = chord_count(radius, sweep, tolerance)
    end = (radius * cos(sweep), radius * sin(sweep))
    points = np.array([(radius, 0.0), *chords((radius, 0.0), end, (0.0, 0.0), sweep, count)])
    middles = 0.5 * (points[1:] + points[:-1])
    assert radius - np.hypot(*middles.T).min() <= tolerance * (1 + 1e-6)


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(1.0, 3.0), st.booleans())
def test_the_centre_of_an_r_arc_is_equidistant_from_both_ends_and_gives_the_shorter_arc(
    x: float, y: float, factor: float, clockwise: bool
) -> None:
    apart = float(np.hypot(x, y))
    centre = arc_centre((0.0, 0.0), (x, y), {"R": 0.5 * factor * apart}, clockwise)
    if apart > 1e-3:
        assert centre is not None
        assert np.hypot(*centre) == pytest.approx(0.5 * factor * apart, rel=1e-6)
        assert abs(sweep_rad((0.0, 0.0), (x, y), centre, clockwise)) <= pi + 1e-6


def test_the_simulated_printer_runs_an_arc_as_the_reader_reads_it() -> None:
    machine = load().machine
    lines = f"{HEAD}G1 X10 Y10 F3000\nG2 X30 Y10 I10 J0 F1800\nM400\n"
    firmware = SimulatedFirmware(machine, BuildOptions(home_start=False))
    firmware.receive(lines.encode())
    firmware.advance()
    record = firmware.record()
    read = parse_gcode(lines.splitlines(), machine)
    ran = shapely.LineString(np.vstack([record.start[:1, :2], record.end[:, :2]]))
    assert shapely.hausdorff_distance(ran, shapely.LineString(np.vstack([[0, 0], read.end[:, :2]]))) < 0.02
    assert record.end[-1, :2] == pytest.approx([30, 10])


def test_a_program_with_arcs_lays_the_same_plastic_as_one_without() -> None:
    flat = _turning(7)
    runs = [dry_run(_program(flat, profile)[0], profile) for profile in (load(), load(settings=ARCS))]
    assert runs[1].segment_mm3.sum() == pytest.approx(runs[0].segment_mm3.sum(), rel=1e-6)
    assert runs[1].time_s == pytest.approx(runs[0].time_s, rel=0.25)


_coordinate = st.floats(-50.0, 50.0)


@given(_coordinate, _coordinate, st.floats(0.5, 40.0), st.floats(-pi, pi), st.floats(0.01, 2.0 * pi), st.booleans())
def test_the_box_of_an_arc_holds_all_its_points_and_touches_them_on_every_side(
    x: float, y: float, radius: float, first: float, swept: float, clockwise: bool
) -> None:
    angles = first + (-swept if clockwise else swept) * np.linspace(0.0, 1.0, 4001)
    points = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])
    start, end = tuple(points[0].tolist()), tuple(points[-1].tolist())
    low, high = arc_box(start, end, (x, y), clockwise)
    assert np.abs(points.min(axis=0) - low).max() < 1e-4
    assert np.abs(points.max(axis=0) - high).max() < 1e-4
