"""The balance of plastic and space, against closed formulas and with faults planted into a valid program."""

from math import cos, nextafter, pi, radians, sin, tan

import numpy as np
import pytest

from machine.dryrun.dryrun import dry_run, summary
from machine.dryrun.interfaces import (
    NOTHING,
    Bars,
    InterfaceBalance,
    balance_of,
    inside_loops,
    interfaces,
    laid,
    lattice_over,
    tops,
)
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import Lines, layers, on, word
from tools.checks.plastic import over_room, wall_edges

FIELD = np.array([[-1.0, -1.0], [11.0, 11.0]])


def bar(begin: tuple[float, ...], end: tuple[float, ...], up: tuple[float, ...], half: float, height: float) -> Bars:
    return Bars(*(np.array([v]) for v in (begin, end, up)), np.array([half]), np.array([height]))


def faces(lines: Lines, machine: str = "generic_ac") -> list[InterfaceBalance]:
    profile, _, _ = bent(machine)
    return list(dry_run(lines, profile).interfaces)


def richer(part: int, layer: int, factor: float) -> Lines:
    return on(layers(part, layer), word("E", lambda e: e * factor, "G1 .*[XY].* E[0-9]"))(list(bent("generic_ac")[2]))


@pytest.mark.parametrize("turn_deg", [0.0, 17.0, 90.0])
def test_no_plastic_is_lost_wherever_a_bar_is(turn_deg: float) -> None:
    lattice, turn = lattice_over(FIELD, 0.05), radians(turn_deg)
    ways = [
        ((2.0 + 0.01 * k, 5.0), (2.0 + 0.01 * k + size * cos(turn), 5.0 + size * sin(turn)))
        for k, size in enumerate((0.01, 1, 5))
    ]
    mm3 = np.array([1.0, 2.0, 3.0])
    begin, end = (np.array([[*way[side], 0.0] for way in ways]) for side in (0, 1))
    bars = Bars(begin, end, np.zeros((3, 3)), np.array([0.2, 0.2, 0.01]), np.ones(3))
    assert laid(bars, mm3, lattice).sum() == pytest.approx(6.0)


@pytest.mark.parametrize("beyond", [1.0, nextafter(1.0, 2.0)])
def test_a_bar_laid_sideways_is_not_lost_to_a_rounding_of_its_direction(beyond: float) -> None:
    lattice = lattice_over(FIELD, 0.05)
    top = tops(bar((5.0, 0.0, 0.0), (5.0, 0.0, 4.0), (beyond, 0.0, 0.0), 0.5, 0.2), lattice, NOTHING)
    under = int((4.9 - lattice.origin[0]) / lattice.cell), int((0.0 - lattice.origin[1]) / lattice.cell)
    assert top[under] == pytest.approx(4.0, abs=0.51)  # its end is round: half its width


@pytest.mark.parametrize("slant_deg", [0.0, 30.0, 60.0])
def test_a_slanted_bar_is_left_through_its_top_or_its_side(slant_deg: float) -> None:
    """Turned about Y by the slant, the top of a bar is the plane z = -x tan, up to its end."""
    slant = radians(slant_deg)
    along, up = (cos(slant), 0.0, -sin(slant)), (sin(slant), 0.0, cos(slant))
    lattice = lattice_over(FIELD, 0.05)
    top = tops(bar((5.0, 0.0, 0.0), (5.0 + 4.0 * along[0], 0.0, 4.0 * along[2]), up, 0.5, 0.2), lattice, NOTHING)
    x = lattice.origin[0] + (np.arange(lattice.shape[0]) + 0.5) * lattice.cell - 5.0
    row = top[:, int((0.02 - lattice.origin[1]) / lattice.cell)]
    over = (x > 0.0) & (x < 4.0 * along[0])
    assert row[over] == pytest.approx(-x[over] * tan(slant), abs=1e-9)
    beyond = (x > 4.5 * along[0] + 1e-6) | (x < -0.5 * along[0] - 0.2 * sin(slant))
    assert (row[beyond] == NOTHING).all()
    ends = (x > 4.0 * along[0]) & (x < 4.49 * along[0] - 0.02)
    assert row[ends] == pytest.approx(-x[ends] * tan(slant), abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_uppermost_bar_counts_whichever_is_laid_first(seed: int) -> None:
    dice = np.random.default_rng(seed)
    ends = dice.uniform(0.0, 4.0, (2, 20, 3))
    up = np.cross(ends[1] - ends[0], dice.normal(size=(20, 3)))  # some of them point down
    bars = Bars(ends[0], ends[1], up / np.linalg.norm(up, axis=1)[:, None], dice.uniform(0.1, 0.5, 20), np.full(20, 0.2))
    lattice = lattice_over(ends.reshape(-1, 3)[:, :2], 0.1)
    one_by_one = np.max([tops(Bars(*(values[k : k + 1] for values in bars)), lattice, NOTHING) for k in range(20)], axis=0)
    assert np.array_equal(tops(bars, lattice, NOTHING), one_by_one)
    assert np.array_equal(tops(Bars(*(values[::-1].copy() for values in bars)), lattice, NOTHING), one_by_one)


def test_loops_enclose_their_area_less_that_of_holes() -> None:
    turn = np.linspace(0.0, 2.0 * pi, 400)
    ring = 5.0 + np.column_stack([np.cos(turn), np.sin(turn)]) * 4.0
    hole = 5.0 + np.column_stack([np.cos(-turn), np.sin(-turn)]) * 2.0
    sides = np.concatenate([np.hstack([loop[:-1], loop[1:]]) for loop in (ring, hole)])
    lattice = lattice_over(FIELD, 0.05)
    assert inside_loops(sides, lattice).sum() * lattice.column_mm2 == pytest.approx(12.0 * pi, rel=2e-3)


def test_a_square_millimetre_with_a_fifth_more_plastic_stands_out() -> None:
    lattice = lattice_over(FIELD, 0.05)
    plastic = np.full(lattice.shape, 1.0)
    plastic[60:100, 60:100] = 1.2
    ratio = over_room(plastic, np.full(lattice.shape, 1.0), lattice)
    assert (float(ratio[80, 80]), float(ratio[150, 150])) == (pytest.approx(1.2), pytest.approx(1.0))


def test_the_section_of_an_interface_is_the_face_that_the_parts_share() -> None:
    assert [face.area_mm2 for face in faces(list(bent("generic_ac")[2]))] == pytest.approx([7.0 * 5.0, 5.0 * 4.0], rel=0.03)


@pytest.mark.parametrize("factor", [0.7, 1.5])
def test_a_changed_first_layer_flow_changes_its_plastic_per_room_by_the_same_factor(factor: float) -> None:
    good, bad = faces(list(bent("generic_ac")[2])), faces(richer(2, 1, factor))
    assert bad[0].over_room / good[0].over_room == pytest.approx(factor, rel=0.06)
    assert bad[1].over_room == pytest.approx(good[1].over_room, rel=0.02)


def test_the_dry_run_keeps_of_every_interface_what_the_columns_come_to() -> None:
    profile, _, lines = bent("generic_ac")
    run = dry_run(lines, profile)
    balances = run.interfaces
    assert balances == tuple(map(balance_of, interfaces(run.program, run.deposited, profile)))
    told = summary(dry_run(richer(2, 1, 1.5), profile))["interfaces"]
    assert [face["part"] for face in told] == [2, 3]
    assert told[0]["plastic_over_room"] == pytest.approx(1.5 * balances[0].over_room, rel=0.06)


def test_other_axes_and_firmwares_show_the_same_interfaces() -> None:
    contact = [[face.contact for face in faces(list(bent(machine)[2]), machine)] for machine in ("generic_ac", "linuxcnc_xyzac")]
    assert contact[0] == pytest.approx(contact[1], abs=0.01)


def test_outer_walls_of_stacked_blocks_rest_on_plastic() -> None:
    profile, _, lines = bent("generic_ac")
    run = dry_run(lines, profile, known=())
    held, inside_mm = wall_edges(next(interfaces(run.program, run.deposited, profile)))
    assert held.mean() > 0.99
    assert np.quantile(inside_mm, 0.9) < 0.05


@pytest.mark.parametrize("machine", ["generic_ac", "gen5x", "linuxcnc_xyzac"])
def test_the_first_layer_of_a_part_fits_its_room_and_touches_nearly_all_of_its_face(machine: str) -> None:
    for face in faces(list(bent(machine)[2]), machine):
        assert 0.95 < face.beads_over_room < 1.2
        assert face.contact > 0.95
