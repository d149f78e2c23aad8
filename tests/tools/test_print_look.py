"""The look at a print sees what is wrong in its layers: in a block written by hand and in a program of the slicer's own."""

import pytest

from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import FAULTS
from tools.print_look import Look, look_at
from tools.read_beads import read_beads

AREA_MM2 = (0.45 - 0.2) * 0.2 + 3.14159 * 0.2**2 / 4  # of a bead 0.45 mm wide and 0.2 high
E_PER_MM = AREA_MM2 / (3.14159 * 1.75**2 / 4)
PITCH_MM = AREA_MM2 / 0.2


def strokes(begin_mm: float, length_mm: float, lines: int, y_mm: float = 0.0) -> list[str]:
    """Lines along x, side by side."""
    text = []
    for k in range(lines):
        y = y_mm + k * PITCH_MM
        text += [f"G0 X{begin_mm:.3f} Y{y:.3f}", f"G1 X{begin_mm + length_mm:.3f} E{length_mm * E_PER_MM:.5f}"]
    return text


def layer(number: int, beads: list[str], kind: str = "Solid infill") -> list[str]:
    z = f"{0.2 * number:.3f}"
    return [";LAYER_CHANGE", f";Z:{z}", ";HEIGHT:0.2", f"G0 Z{z}", f";TYPE:{kind}", ";WIDTH:0.45", *beads]


def block(**instead: list[str]) -> list[str]:
    """Ten layers of 20 lines, 12 mm long; a layer given as l5=... has those beads."""
    text = ["G90", "M83", ";PART:1 of 1", ";POSE:A0.0000 C0.0000"]
    for number in range(1, 11):
        text += instead.get(f"l{number}", layer(number, strokes(0.0, 12.0, 20)))
    return text


def test_a_whole_block_is_seen_whole() -> None:
    look = look_at(block())
    assert (look.strokes_mm, look.unsupported_mm, look.suspect) == (pytest.approx(10 * 20 * 12.0), 0.0, [])


def test_strokes_are_read_with_their_plastic() -> None:
    beads = read_beads(block())
    assert len(beads.line) == 200
    assert beads.mm3.sum() == pytest.approx(10 * 20 * 12.0 * AREA_MM2, rel=1e-4)


def test_a_missing_layer_is_a_gap_with_its_length_in_the_air() -> None:
    look = look_at(block(l5=[]))
    assert look.missing == ("part 1 layer 5",)
    assert look.unsupported_mm == pytest.approx(20 * 12.0)


def test_a_stretch_over_nothing_is_measured_where_no_bridge_is_told() -> None:
    beads = [*strokes(0.0, 12.0, 20), *strokes(30.0, 25.0, 1)]
    look = look_at(block(l5=layer(5, beads)))
    assert look.air_mm.value == pytest.approx(25.0)
    assert look.suspect == [f"25.0 mm in the air that no bridge is, {look.air_mm.at}"]
    bridged = look_at(block(l5=[*layer(5, strokes(0.0, 12.0, 20)), ";TYPE:Bridge infill", *strokes(30.0, 25.0, 1)]))
    assert (bridged.told_mm, bridged.air_mm.value, bridged.suspect) == (pytest.approx(25.0), 0.0, [])


def test_a_stretch_over_sparse_infill_is_told_apart() -> None:
    grid = [line for k in range(4) for line in strokes(0.0, 12.0, 1, y_mm=2.0 * k)]
    rungs = [line for x in range(0, 13, 4) for line in (f"G0 X{x} Y0", f"G1 Y6 E{6 * E_PER_MM:.5f}")]
    sparse, floor = layer(9, grid + rungs, "Internal infill"), layer(10, strokes(0.0, 12.0, 15))
    look = look_at(block(l9=sparse, l10=floor))
    assert look.sparse_mm.value == pytest.approx(4.0 - 0.45, abs=0.3)
    assert look.air_mm.value < 1.0


@pytest.mark.parametrize(("flow", "suspect"), [(0.6, 1), (1.0, 0), (1.04, 0), (1.5, 1)])
def test_plastic_that_the_beads_have_no_room_for_or_too_little_of_it_is_seen(flow: float, suspect: int) -> None:
    thin = [
        line if " E" not in line else f"{line.split(' E')[0]} E{flow * float(line.split(' E')[1])}" for line in strokes(0, 12, 20)
    ]
    assert len(look_at(block(l5=layer(5, thin))).suspect) == suspect


def test_a_layer_that_is_laid_twice_holds_plastic_twice() -> None:
    twice = look_at(block(l5=layer(5, strokes(0.0, 12.0, 20) * 2)))
    assert twice.twice.value > 0.7
    assert look_at(block()).twice.value == 0.0


@pytest.mark.parametrize(("fault", "words"), [
    ("a layer missing", "a gap below part 1 layer 20"), ("four layers missing", "a gap below part 2 layer 12"),
    ("a layer 0.1 mm too high", "a gap below part 1 layer 25"), ("45 mm laid in the air", "45.0 mm in the air that no bridge is"),
    ("a layer printed twice", "of part 1 layer 10 hold plastic twice"), ("a part printed twice", "hold plastic twice"),
    ("a layer at 80 % flow", "% too much or too little plastic in part 1 layer 18")])  # fmt: skip
def test_faults_planted_into_a_print_of_three_parts_are_seen_and_it_is_clean_without(fault: str, words: str) -> None:
    _, _, lines = bent("generic_ac")
    planted = next(kind for kind in FAULTS if kind.name == fault)
    assert look_at(lines).suspect == []
    assert any(words in reason for reason in look_at(planted.edit(list(lines))).suspect)


def test_both_looks_together_add_lengths_and_keep_the_worst() -> None:
    _, _, lines = bent("generic_ac")
    look = look_at(lines)
    both = look.merged_with(look)
    assert (both.strokes_mm, both.volume) == (2 * look.strokes_mm, look.volume)
    assert look.merged_with(Look()) == look
