import pytest

from machine.dryrun import dry_run
from machine.dryrun.findings import Finding
from profiles.machine import Box, Head
from profiles.profile import load
from tests.machine.hand import printed, text

HEAD = Head(nozzle_mm=0.4, silhouette_mm=[(0.5, 0.0), (5.0, 3.0)], boxes=[])
WALL = "G28\nG92 A0 C0\nM109 S210\nM83\n;WIDTH:0.4\nG0 Z60 F600\nG0 X-20\nG1 X20 E1 F600\nG0 Z90\nG0 C90 F600\n"


def _contacts(moves: str, head: Head = HEAD) -> list[Finding]:
    machine = load().machine.model_copy(update={"head": head})
    profile = load().model_copy(update={"machine": machine})
    return [f for f in dry_run((WALL + moves).splitlines(), profile).findings if f.code == "contact"]


def test_a_travel_through_an_earlier_line_is_found() -> None:
    # turned by 90 degrees the line lies along Y at X = 0, its top at Z 60
    found = _contacts("G0 X-20\nG0 Z58\nG0 X20")
    assert [(f.line, f.severity) for f in found] == [(13, "error")]
    assert "runs 2 mm deep" in found[0].message


@pytest.mark.parametrize("moves", ["G0 X-20\nG0 Z60\nG0 X20", "G0 X-20\nG0 Z58\nG0 X-6", "G0 X-20\nG0 Z59.7\nG0 X20"])
def test_travel_above_next_to_and_within_a_bead_s_width_is_clear(moves: str) -> None:
    assert not _contacts(moves)


def test_the_hot_end_s_flank_is_checked_at_its_own_height() -> None:
    # 2.75 mm beside the line the flank hangs 1.5 mm above the tip, 1.37 mm above the bead's edge
    assert not _contacts("G0 X-20\nG0 Z58.5\nG0 X-2.75")
    depth = float(_contacts("G0 X-20\nG0 Z58\nG0 X-2.75")[0].message.split()[3])
    assert depth == pytest.approx(0.63, abs=0.1)


def test_a_box_of_the_head_counts_where_it_is() -> None:
    duct = Head(nozzle_mm=0.4, silhouette_mm=[(0.5, 0.0)], boxes=[Box(name="duct", min_mm=(10, -5, 1), max_mm=(20, 5, 8))])
    assert _contacts("G0 X-20\nG0 Z57\nG0 X-15", duct)
    assert not _contacts("G0 Y30\nG0 Z57\nG0 X-20", duct)


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
def test_a_generated_program_touches_nothing(machine: str) -> None:
    assert not [f for f in dry_run(text(machine), printed(machine)[0]).findings if f.code == "contact"]
