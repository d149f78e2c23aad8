"""Kill the host, or cut the power, at random moments of a print and resume from its journal.

    python tools/campaigns/kills.py [--moments 200] [--seed 1] [--build stock|advanced] [--power]

The printer is in memory with a virtual clock, a stock Marlin (no ADVANCED_OK) or one with ADVANCED_OK, on a line of 115200 baud.
The host dies at a random moment: only its journal up to then remains. With --power the printer is reset too, otherwise it lives
on. A moment passes when the executed moves of both runs together are the program's without a gap; repeated moves are counted. If
the journal leaves the height in doubt, that is counted, and the height nearest to the true one is chosen, as a user at the
printer would.
"""

import random
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copyfile

import numpy as np

from machine.gcode.lines import GcodeFile
from machine.link.journal import Journal, JournalHeading, read_journal
from machine.link.medium import Medium, Wire
from machine.link.resume import ResumePoint, heights_mm, is_in_doubt, plan_resume, read_interrupted_print
from machine.link.status import PrinterStatus
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from profiles.errors import JournalError
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter
from tools.campaigns.harness import options_of, table

PROFILE = load()
LIMIT = 95
START = [
    "G21", "M84 S0", "G90", "M83", "M140 S25", "M104 S175", "G28 X Y Z", "G92 A0 C0", "M190 S25",
    "M109 S175", "G92 E0", "M106 S128",
]  # fmt: skip
POSES = ((0, 0), (30, 725), (-20, 360))
LAYERS, STROKES = 16, 40
BAUD, RING = 115200, 128
BEGUN, KNOWN, IN_DOUBT = "hardly begun: anew", "height known", "height in doubt, asked"  # possible states of the journal
LIFT_MM, GROUP = 0.6, 10
Moves = list[list[float]]


@dataclass(frozen=True)
class Result:
    """Result of one moment. executed: moves before the second run; first: the program's move with which that began. off_mm:
    height error of the resumed print after a power cut."""

    how: str
    executed: int
    first: int
    off_mm: float = 0.0

    @property
    def gap(self) -> int:
        """Number of moves that neither run executed."""
        return max(0, self.first - self.executed)

    @property
    def twice(self) -> int:
        """Number of moves that both runs executed."""
        return max(0, self.executed - self.first)


def program() -> list[str]:
    """Three parts in three poses, with different ends of all moves; every tenth stroke follows a lifted travel."""
    lines = list(START)
    for part, (tilt, turn) in enumerate(POSES, 1):
        lines += [f";PART:{part} of {len(POSES)}", "G1 E-2 F2100", "G0 Z150 F900", f"G0 A{tilt} C{turn} F6000"]
        lines += ["G0 X10 Y10 F6000", f"G0 Z{60 + part} F900", "G1 E2 F2100"]
        for layer in range(LAYERS):
            z = 60 + part + 0.2 * layer
            lines += [";LAYER_CHANGE", f"G0 Z{z:.2f} F900"]
            for i in range(STROKES):
                place = f"X{10 + 7 * i % 23 + 0.01 * i:.3f} Y{10 + 5 * i % 19}"
                if i % GROUP == GROUP - 1:
                    lines += [
                        "G1 E-0.8 F2100",
                        f"G0 Z{z + LIFT_MM:.2f} F900",
                        f"G0 {place}.5 F9000",
                        f"G0 Z{z:.2f} F900",
                        "G1 E0.8 F2100",
                    ]
                lines.append(f"G1 {place} E0.0{5 + i % 3} F1800")
    return [*lines, "M104 S0", "M140 S0"]


class HostGoneError(BaseException):
    """The host is dead: it must not do anything on its way out."""


class _Plug:
    """A wire whose host dies at a time; on_end: called then."""

    def __init__(self, wire: Wire, printer: VirtualPrinter, end_s: float, on_end: Callable[[], object]) -> None:
        self._wire, self._printer, self._end_s, self._on_end, self.name = wire, printer, end_s, on_end, wire.name
        self.discard, self.close = wire.discard, wire.close

    def write(self, data: bytes) -> None:
        self._look()
        self._wire.write(data)

    def read(self) -> bytes:
        self._look()
        return self._wire.read()

    def _look(self) -> None:
        if self._printer.now_s >= self._end_s:
            self._on_end()
            raise HostGoneError


def moves_of(printer: VirtualPrinter) -> Moves:
    """X Y Z tilt turn at the end of each executed move, and its filament."""
    record = printer.record
    rows: Moves = np.column_stack([record.end[:, :5], record.end[:, 5] - record.start[:, 5]]).round(4).tolist()
    return rows


def moment(build: BuildOptions, text: GcodeFile, folder: Path, end_s: float, whole: Moves, power: bool) -> Result:
    """Kill the host of a print, or cut the power, after some time, and resume. whole: the moves of an undisturbed print."""
    printer, journal, left = VirtualPrinter(PROFILE.machine, build, baud=BAUD), folder / "journal", folder / "left"
    medium, heading = printer.medium, JournalHeading(str(text.path), text.sha256(), "campaign", {})

    def end() -> None:
        copyfile(journal, left)  # before the way out writes anything more
        if power:
            printer.firmware.reset()

    plugged = Medium(lambda name, baud: _Plug(medium.open(name, baud), printer, end_s, end), medium.now_s, medium.wait)
    try:
        with Journal(journal, heading) as written:
            print_lines(text, PATH, BAUD, journal=written, profile=PROFILE, medium=plugged)
    except HostGoneError:
        pass
    if not left.exists():
        return Result("over before", len(whole), len(whole))
    stood_mm, done = printer.firmware.board.motion.at(printer.now_s)[2], len(moves_of(printer))
    point, doubts = read_interrupted_print(text, read_journal(left).last, PROFILE, LIMIT), list[int]()

    def begin(status: PrinterStatus) -> ResumePoint:
        way, seen_point = plan_resume(point, status, PROFILE), point
        if is_in_doubt(way, point, PROFILE):
            doubts.append(len(heights_mm(point)))
            seen_point = replace(point, stood_mm=min(heights_mm(point), key=lambda z: abs(z - stood_mm)))
        return plan_resume(seen_point, status, PROFILE)

    try:
        with Journal(folder / "rest", heading) as written:
            print_lines(text, PATH, BAUD, journal=written, profile=PROFILE, begin=begin, medium=medium)
    except JournalError as refused:
        return Result(f"refused: {str(refused).partition(': ')[2].partition(',')[0]}", done, done)
    how = BEGUN if not point.stroked else IN_DOUBT if doubts else KNOWN
    return judged_cut(how, done, moves_of(printer), whole) if power else judged(how, moves_of(printer), whole)


def same_ends(moves: Moves, whole: Moves) -> int:
    """Number of common moves at the ends of both."""
    pairs = zip(reversed(moves), reversed(whole), strict=False)
    return next((count for count, (move, planned) in enumerate(pairs) if move != planned), min(len(moves), len(whole)))


def judged(how: str, moves: Moves, whole: Moves) -> Result:
    """Split the executed moves into the first run's, a beginning of the program, and the second's, an end of it."""
    first = same_ends(moves[::-1], whole[::-1])
    return Result(how, first, len(whole) - same_ends(moves[first:], whole))


def judged_cut(how: str, done: int, moves: Moves, whole: Moves) -> Result:
    """Judge the moves after a power cut; the rest is compared without Z, whose error is measured. done: moves before the cut,
    including the current one."""
    flat, planned = ([[*move[:2], *move[3:]] for move in rows] for rows in (moves, whole))
    tail = same_ends(flat[done:], planned)
    pairs = zip(moves[len(moves) - tail :], whole[len(whole) - tail :], strict=True)
    off_mm = max((abs(laid[2] - wanted[2]) for laid, wanted in pairs if wanted[5] > 0), default=0.0)  # of strokes only
    whole_moves = done - 1 if moves[done - 1] != whole[done - 1] else done  # the current move must be repeated
    return Result(how, whole_moves, len(whole) - tail, off_mm)


def campaign(moments: int, seed: int, build: BuildOptions, power: bool) -> list[Result]:
    """Results of random moments between the first stroke and the end of a print."""
    chance, results = random.Random(seed), list[Result]()
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "program.gcode"
        file.write_text("\n".join(program()) + "\n", encoding="utf-8")
        text, printer = GcodeFile(file), VirtualPrinter(PROFILE.machine, build, baud=BAUD)
        print_lines(text, PATH, BAUD, profile=PROFILE, medium=printer.medium)
        whole, begun_s = moves_of(printer), float(printer.record.begin_s[0])
        for number in range(moments):
            folder = Path(name) / str(number)
            folder.mkdir()
            results.append(moment(build, text, folder, chance.uniform(begun_s, printer.now_s), whole, power))
    return results


def main() -> None:
    """Run the campaign and print a table."""
    parser = options_of(__doc__, moments=200, seed=1)
    parser.add_argument("--build", choices=("stock", "advanced"), default="stock")
    parser.add_argument("--power", action="store_true")
    given = parser.parse_args()
    build = BuildOptions(advanced_ok=given.build == "advanced", rx_ring=RING)
    columns = {
        "moments": len,
        "moves missing": lambda mine: sum(result.gap for result in mine),
        "moves made twice, most": lambda mine: max(result.twice for result in mine),
        "Z wrong by at most, mm": lambda mine: f"{max(result.off_mm for result in mine):.2f}",
    }
    results = campaign(given.moments, given.seed, build, given.power)
    print(table(results, "state of the journal", lambda result: result.how, columns))


if __name__ == "__main__":
    main()
