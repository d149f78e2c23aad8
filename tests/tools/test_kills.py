"""The campaign of killed hosts: how its runs are judged, and a short run."""

import re
import tempfile
from collections.abc import Callable
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from machine.link.journal import SYNC_S, Checkpoint, Journal, JournalHeading
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from tests.machine.virtual_printer import PATH, VirtualPrinter
from tools.campaigns import kills
from tools.campaigns.kills import BAUD, IN_DOUBT, LAYERS, LIFT_MM, PROFILE, RING, START, campaign, judged, judged_cut

CURVE_STROKES, CURVE_MM = 600, 24.0  # of a round wall, 0.25 mm long each
STROKE = re.compile(r"G1 (X|E\d)")  # extrudes filament
WHOLE = [[float(k), 0.0] for k in range(10)]


@pytest.mark.parametrize(("moves", "gap", "twice"), [
    (WHOLE, 0, 0),
    (WHOLE[:6] + WHOLE[6:], 0, 0),
    ([*WHOLE[:6], [99.0, 0.0], *WHOLE[4:]], 0, 2),
    ([*WHOLE[:6], [99.0, 0.0], *WHOLE[8:]], 2, 0),
    (WHOLE[:6], 4, 0),
    ([], 10, 0),
])  # fmt: skip
def test_missing_and_doubled_moves_are_counted(moves: list[list[float]], gap: int, twice: int) -> None:
    result = judged("any", moves, WHOLE)
    assert (result.gap, result.twice) == (gap, twice)


@pytest.mark.slow
def test_three_killed_hosts_leave_no_gap_and_repeat_no_more_than_the_documented_lines(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kills, "LAYERS", 8)
    for result in campaign(3, 11, BuildOptions(rx_ring=RING), power=False):
        assert (result.gap, result.twice <= 23) == (0, True), result.how


STROKES = [[float(k), 0.0, 1.0, 0.0, 0.0, 0.1] for k in range(10)]
APPROACH = [[5.0, 0.0, 9.0, 0.0, 0.0, 0.0], [4.0, 0.0, 1.0, 0.0, 0.0, 0.8]]


@pytest.mark.parametrize(("rest", "gap", "twice", "off_mm"), [
    (STROKES[5:], 0, 0, 0.0),
    (STROKES[3:], 0, 2, 0.0),
    (STROKES[6:], 1, 0, 0.0),
    ([[*move[:2], move[2] + 0.3, *move[3:]] for move in STROKES[5:]], 0, 0, 0.3),
])  # fmt: skip
def test_a_cut_is_judged_by_moves_missing_and_doubled_and_by_the_height(
    rest: list[list[float]], gap: int, twice: int, off_mm: float
) -> None:
    begun = [[4.5, 0.0, 1.0, 0.0, 0.0, 0.05]]  # the interrupted move at the power failure does not count
    cut = judged_cut("any", 6, [*STROKES[:5], *begun, *APPROACH, *rest], STROKES)
    assert (cut.gap, cut.twice, cut.off_mm) == (gap, twice, pytest.approx(off_mm))


@pytest.mark.slow
@pytest.mark.parametrize(("advanced", "most"), [(False, 20), (True, 23)])
def test_power_cuts_lose_no_stroke_and_no_height(monkeypatch: pytest.MonkeyPatch, advanced: bool, most: int) -> None:
    monkeypatch.setattr(kills, "LAYERS", 3)
    for cut in campaign(4, 5, BuildOptions(advanced_ok=advanced, rx_ring=RING), power=True):
        assert (cut.gap, cut.twice <= most) == (0, True), cut.how
        assert cut.off_mm < (LIFT_MM / 2 + 0.005 if cut.how == IN_DOUBT else 0.005), cut.how


def curved_program(layers: int = LAYERS // 2, strokes: int = CURVE_STROKES) -> list[str]:
    """A round wall of short strokes, which the serial line can hardly deliver fast enough."""
    lines = [*START, "G0 Z60 F900", "G0 X10 Y10 F6000"]
    for layer in range(layers):
        lines += [";LAYER_CHANGE", f"G0 Z{60 + 0.2 * layer:.2f} F900"]
        for number in range(strokes):
            angle = 2 * pi * number / CURVE_STROKES
            lines.append(f"G1 X{30 + CURVE_MM * cos(angle):.3f} Y{30 + CURVE_MM * sin(angle):.3f} E0.0{5 + number % 3} F3600")
    return lines


class _TimedJournal(Journal):
    """A journal that records when each executed line was noted in its file and on the disk."""

    def __init__(self, path: Path, now_s: Callable[[], float]) -> None:
        self.in_file: list[tuple[float, int]] = [(0.0, 0)]
        self.on_disk: list[tuple[float, int]] = [(0.0, 0)]
        self._now_s = now_s
        super().__init__(path, JournalHeading("p.gcode", "", "campaign", {}))

    def write(self, checkpoint: Checkpoint, hurry: bool = False) -> None:
        """Record the time, too. Without hurry, the disk is updated once in SYNC_S."""
        super().write(checkpoint, hurry)
        now_s = self._now_s()
        if hurry or now_s - self.on_disk[-1][0] >= SYNC_S:
            self.on_disk.append((now_s, checkpoint.executed if hurry else self.in_file[-1][1]))
        self.in_file.append((now_s, checkpoint.executed))


def count_repeats(build: BuildOptions, lines: list[str], moments: int = 1000, seed: int = 1) -> dict[str, tuple[float, int]]:
    """Strokes that a print would repeat after a power failure: mean over random moments and the worst case, for a journal
    whose whole file is left, and for one of which only the synced part is left."""
    printer = VirtualPrinter(PROFILE.machine, build, baud=BAUD)
    with tempfile.TemporaryDirectory() as name, _TimedJournal(Path(name) / "journal", lambda: printer.now_s) as journal:
        print_lines(lines, PATH, BAUD, profile=PROFILE, medium=printer.medium, journal=journal)
    record = printer.record
    pushes = record.end[:, 5] - record.start[:, 5] > 1e-9
    ends_s = np.sort((record.begin_s + record.duration_s)[pushes])
    before = np.cumsum([0, *(STROKE.match(line) is not None for line in lines)])
    cuts_s = np.random.default_rng(seed).uniform(record.begin_s[pushes][0], ends_s[-1], moments)
    counts = {}
    for where, notes in (("file", journal.in_file), ("disk", journal.on_disk)):
        times_s, executed = np.array([time_s for time_s, _ in notes]), before[[line for _, line in notes]]
        twice, worst = (
            np.searchsorted(ends_s, at_s, side="right") - executed[np.searchsorted(times_s, at_s, side="right") - 1]
            for at_s in (cuts_s, ends_s)
        )
        counts[where] = float(twice.mean()), int(worst.max())
    return counts


@pytest.mark.parametrize(("advanced", "most", "usual"), [(False, 15 + 4 + 1, 6.0), (True, 15 + 4 + 4, 3.0)])
def test_at_no_moment_of_a_print_are_more_strokes_off_record_than_the_documented_bound(
    advanced: bool, most: int, usual: float
) -> None:
    """Lines in the planner, lines since the newest record, lines in flight: docs/serial.md, Journal and resume."""
    counts = count_repeats(BuildOptions(advanced_ok=advanced, rx_ring=RING), curved_program(layers=2, strokes=300))
    mean, worst = counts["file"]
    assert (worst <= most, mean <= usual) == (True, True), counts
