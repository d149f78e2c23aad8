"""Kill a host, or cut the power, at random moments of a print and resume from its journal.

Run: python -m tools.kill_campaign [MOMENTS] [SEED] [--power stock|advanced | --repeats]
(default 200 moments; figures: tools/RESULTS.md)
A moment passes when the executed moves, both runs together, are the program's without a gap; what was done twice is counted.

Without --power the host is killed and the printer, in another process, lives on. With it both lose their power: a printer in
memory, as stock Marlins are built (no ADVANCED_OK) or with ADVANCED_OK, on a line of 115200 baud. Where the journal leaves the
height in doubt it is counted, and the height that is nearest to the real one is chosen, as a person would who looks.

With --repeats nothing is resumed: of one print it is counted how many strokes were done but not on record, at random moments and
at the worst one; on record in the file, and on the disk (what a computer keeps that loses its power together with the printer).
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import cos, inf, pi, sin
from pathlib import Path
from time import monotonic, sleep

import numpy as np

from machine.gcode.lines import GcodeFile
from machine.link.journal import SYNC_S, Checkpoint, Journal, JournalHeading, read_journal
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.protocol.timeout import Timing
from machine.link.resume import ResumePoint, heights_mm, is_in_doubt, plan_resume, read_interrupted_print
from machine.link.status import PrinterStatus
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import JournalError
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
LIMIT = 95
GREETING_S = 0.15  # before that nothing has been sent
QUICK = replace(SERIAL, timing=Timing(drain_s=0.05, quiet_s=0.03))
START = [
    "G21", "M84 S0", "G90", "M83", "M140 S25", "M104 S175", "G28 X Y Z", "G92 A0 C0", "M190 S25",
    "M109 S175", "G92 E0", "M106 S128",
]  # fmt: skip
POSES = ((0, 0), (30, 725), (-20, 360))
LAYERS, STROKES = 16, 40
SPEED = 500.0  # times real time, of every other printer: its planner is full when the host dies
BAUD, RING = 115200, 128
IN_DOUBT = "height in doubt, asked"  # one end of a power cut
LIFT_MM, GROUP = 0.6, 10  # every tenth stroke is reached by a lifted travel
CURVE_STROKES, CURVE_MM = 600, 24.0  # of a round wall, 0.25 mm long each
STROKE = re.compile(r"G1 (X|E\d)")  # pushes filament


@dataclass(frozen=True)
class Result:
    """What became of one moment. executed: moves before the second run; first: the program's move with which it began. After a
    power cut, off_mm: how much too high, or low, the print went on.
    """

    how: str
    executed: int
    first: int
    off_mm: float = 0.0

    @property
    def gap(self) -> int:
        """Moves that no run has made."""
        return max(0, self.first - self.executed)

    @property
    def twice(self) -> int:
        """Moves that both have made."""
        return max(0, self.executed - self.first)


def program() -> list[str]:
    """Three parts at three poses, each move with an end of its own."""
    lines = list(START)
    for part, (tilt, turn) in enumerate(POSES, 1):
        lines += [
            f";PART:{part} of {len(POSES)}",
            "G1 E-2 F2100",
            "G0 Z150 F900",
            f"G0 A{tilt} C{turn} F6000",
            "G0 X10 Y10 F6000",
        ]
        lines += [f"G0 Z{60 + part} F900", "G1 E2 F2100"]
        for layer in range(LAYERS):
            lines += [";LAYER_CHANGE", f"G0 Z{60 + part + 0.2 * layer:.2f} F900"]
            lines += [f"G1 X{10 + 7 * i % 23 + 0.01 * i:.3f} Y{10 + 5 * i % 19} E0.0{5 + i % 3} F1800" for i in range(STROKES)]
    return [*lines, "M104 S0", "M140 S0"]


def serve(link: str, record: str, speed: float) -> None:
    """The printer's process: lives until its standard input ends, then writes down what it has executed."""
    with SimulatedPrinter(PROFILE.machine, speed, at=Path(link)) as printer:
        print("ready", flush=True)
        sys.stdin.read()
        done = printer.record
        moved = np.column_stack([done.end[:, :5], done.end[:, 5] - done.start[:, 5]])
        Path(record).write_text(json.dumps(moved.round(4).tolist()), encoding="utf-8")


@contextmanager
def printer(folder: Path, speed: float) -> Iterator[Path]:
    """A printer in a process of its own; folder/record.json is there afterwards."""
    link = folder / "tty"
    words = [sys.executable, "-m", "tools.kill_campaign", "--printer", str(link), str(folder / "record.json"), str(speed)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        if process.stdin is None or process.stdout is None:
            return
        process.stdout.readline()
        yield link
        process.stdin.close()


def apart(work: Callable[[], object]) -> int:
    """ResumePoint work in a child process; its id."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    return child


def begin_print(text: GcodeFile, port: Path, journal: Path) -> None:
    """A print with a journal."""
    with Journal(journal, JournalHeading(str(text.path), text.sha256(), "campaign", {})) as record:
        print_lines(text, str(port), 250000, medium=QUICK, journal=record, profile=PROFILE)


def go_on(text: GcodeFile, port: Path, journal: Path, plan_file: Path) -> None:
    """Resume as the command does, without asking; writes down how."""
    story = read_journal(journal)
    point = read_interrupted_print(text, story.last, PROFILE, LIMIT)

    def begin(status: PrinterStatus) -> ResumePoint:
        way = plan_resume(point, status, PROFILE)
        plan_file.write_text(json.dumps([way.line, way.reason.partition(":")[0].partition(";")[0]]), encoding="utf-8")
        return way

    with Journal(journal.with_suffix(".rest"), story.heading) as record:
        print_lines(text, str(port), 250000, medium=QUICK, journal=record, profile=PROFILE, begin=begin)


def moment(delay_s: float, speed: float, folder: Path, whole: list[list[float]]) -> Result:
    """Kill the host of one print after some time and resume it. whole: the moves of an undisturbed print."""
    text, journal = GcodeFile(folder / "program.gcode"), folder / "journal"
    text.path.write_text("\n".join(program()) + "\n", encoding="utf-8")
    how = "killed before its journal was begun"
    with printer(folder, speed) as port:
        child = apart(lambda: begin_print(text, port, journal))
        sleep(delay_s)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        plan_file = folder / "plan"
        if not journal.exists() or not journal.read_bytes():
            begin_print(text, port, folder / "again")
        elif read_journal(journal).finished:
            how = "killed after its end"
        else:
            code = os.waitstatus_to_exitcode(os.waitpid(apart(lambda: go_on(text, port, journal, plan_file)), 0)[1])
            how = json.loads(plan_file.read_text())[1] if plan_file.exists() else "nothing left to do"
            if code and plan_file.exists():
                how = f"FAILED: {how}"
    return judged(how, json.loads((folder / "record.json").read_text()), whole)


def judged(how: str, moves: list[list[float]], whole: list[list[float]]) -> Result:
    """Part the executed moves into the first run's, a beginning of the program, and the second's, an end of it."""
    last = 0
    while last < min(len(moves), len(whole)) and moves[last] == whole[last]:
        last += 1
    tail = 0
    while tail < min(len(moves) - last, len(whole)) and moves[-1 - tail] == whole[-1 - tail]:
        tail += 1
    return Result(how, last, len(whole) - tail)


def undisturbed(folder: Path, speed: float) -> tuple[list[list[float]], float]:
    """Moves and seconds of a whole print."""
    text = GcodeFile(folder / "program.gcode")
    text.path.write_text("\n".join(program()) + "\n", encoding="utf-8")
    with printer(folder, speed) as port:
        began_s = monotonic()
        begin_print(text, port, folder / "journal")
        taken_s = monotonic() - began_s
    return json.loads((folder / "record.json").read_text()), taken_s


def campaign(moments: int, seed: int) -> list[Result]:
    """Results of many random moments, every other one on a printer that takes its time."""
    chance, results = random.Random(seed), []
    undone = {}
    for speed in (inf, SPEED):
        with tempfile.TemporaryDirectory() as name:
            undone[speed] = undisturbed(Path(name), speed)
    for number in range(moments):
        with tempfile.TemporaryDirectory() as name:
            speed = inf if number % 2 else SPEED
            whole, taken_s = undone[speed]
            results.append(moment(chance.uniform(GREETING_S, taken_s), speed, Path(name), whole))
    return results


def lifted_program() -> list[str]:
    """The same with travels as a slicer writes them: filament pulled back, up, across, down, filament pushed."""
    lines: list[str] = []
    z, strokes = 0.0, 0
    for line in program():
        if (height := re.match(r"G0 Z(\S+)", line)) is not None:
            z, strokes = float(height[1]), 0
        if re.match(r"G1 X", line) is not None:
            strokes += 1
            if strokes % GROUP == 0:
                x, y = line.split()[1:3]
                lines += ["G1 E-0.8 F2100", f"G0 Z{z + LIFT_MM:.2f} F900", f"G0 {x} {y}.5 F9000"]
                lines += [f"G0 Z{z:.2f} F900", "G1 E0.8 F2100"]
        lines.append(line)
    return lines


class PowerCutError(BaseException):
    """The host has no power any more: nothing is done on its way out."""


class _Plug:
    """A wire whose host and printer lose their power at a time."""

    def __init__(self, wire: Wire, printer: VirtualPrinter, cut_s: float) -> None:
        self._wire, self._printer, self._cut_s, self.name = wire, printer, cut_s, wire.name
        self.discard, self.close = wire.discard, wire.close

    def write(self, data: bytes) -> None:
        self._look()
        self._wire.write(data)

    def read(self) -> bytes:
        self._look()
        return self._wire.read()

    def _look(self) -> None:
        if self._printer.now_s >= self._cut_s:
            self._printer.firmware.reset()
            raise PowerCutError


def moves_of(printer: VirtualPrinter) -> list[list[float]]:
    """X Y Z tilt turn where each executed move ended, and its filament."""
    record = printer.record
    rows: list[list[float]] = np.column_stack([record.end[:, :5], record.end[:, 5] - record.start[:, 5]]).round(4).tolist()
    return rows


def power_cut(build: BuildOptions, text: GcodeFile, journal: Path, cut_s: float, whole: list[list[float]]) -> Result:
    """Cut the power of a print after some time, and resume it. whole: the moves of an undisturbed print."""
    printer = VirtualPrinter(PROFILE.machine, build, baud=BAUD)
    medium, heading = printer.medium, JournalHeading(str(text.path), text.sha256(), "campaign", {})
    plugged = Medium(lambda name, baud: _Plug(medium.open(name, baud), printer, cut_s), medium.now_s, medium.wait)
    try:
        with Journal(journal, heading) as written:
            print_lines(text, PATH, BAUD, journal=written, profile=PROFILE, medium=plugged)
    except PowerCutError:
        pass
    stood_mm = printer.firmware.board.motion.at(printer.now_s)[2]
    point, doubts = read_interrupted_print(text, read_journal(journal).last, PROFILE, LIMIT), list[int]()

    def begin(status: PrinterStatus) -> ResumePoint:
        way, seen_point = plan_resume(point, status, PROFILE), point
        if is_in_doubt(way, point, PROFILE):
            doubts.append(len(heights_mm(point)))
            seen_point = replace(point, stood_mm=min(heights_mm(point), key=lambda z: abs(z - stood_mm)))
        return plan_resume(seen_point, status, PROFILE)

    done = len(moves_of(printer))
    try:
        with Journal(journal.with_suffix(".rest"), heading) as written:
            print_lines(text, PATH, BAUD, journal=written, profile=PROFILE, begin=begin, medium=medium)
    except JournalError as refused:
        return Result(f"refused: {str(refused).partition(': ')[2].partition(',')[0]}", done, done)
    how = "hardly begun: anew" if not point.stroked else IN_DOUBT if doubts else "height known"
    return judged_cut(how, done, moves_of(printer), whole)


def judged_cut(how: str, done: int, moves: list[list[float]], whole: list[list[float]]) -> Result:
    """done: moves before the cut, the one under way included. The rest is compared without Z, whose error is measured."""
    flat, planned = ([[*move[:2], *move[3:]] for move in rows] for rows in (moves, whole))
    tail = 0
    while tail < min(len(moves) - done, len(whole)) and flat[-1 - tail] == planned[-1 - tail]:
        tail += 1
    pairs = zip(moves[len(moves) - tail :], whole[len(whole) - tail :], strict=True)
    off_mm = max((abs(laid[2] - wanted[2]) for laid, wanted in pairs if wanted[5] > 0), default=0.0)  # of strokes alone
    whole_moves = done - 1 if moves[done - 1] != whole[done - 1] else done  # the one under way has to be made again
    return Result(how, whole_moves, len(whole) - tail, off_mm)


def cut_campaign(cuts: int, seed: int, build: BuildOptions) -> list[Result]:
    """Results of power cuts at random moments between the first stroke and the end."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        text = GcodeFile(Path(name) / "program.gcode")
        text.path.write_text("\n".join(lifted_program()) + "\n", encoding="utf-8")
        printer = VirtualPrinter(PROFILE.machine, build, baud=BAUD)
        print_lines(text, PATH, BAUD, profile=PROFILE, medium=printer.medium)
        whole, begun_s = moves_of(printer), float(printer.record.begin_s[0])
        moments = [chance.uniform(begun_s, printer.now_s) for _ in range(cuts)]
        return [power_cut(build, text, Path(name) / f"{number}", cut_s, whole) for number, cut_s in enumerate(moments)]


def curved_program(layers: int = LAYERS // 2, strokes: int = CURVE_STROKES) -> list[str]:
    """A round wall of short strokes, which the line brings hardly fast enough."""
    lines = [*START, "G0 Z60 F900", "G0 X10 Y10 F6000"]
    for layer in range(layers):
        lines += [";LAYER_CHANGE", f"G0 Z{60 + 0.2 * layer:.2f} F900"]
        for number in range(strokes):
            angle = 2 * pi * number / CURVE_STROKES
            lines.append(f"G1 X{30 + CURVE_MM * cos(angle):.3f} Y{30 + CURVE_MM * sin(angle):.3f} E0.0{5 + number % 3} F3600")
    return lines


class _TimedJournal(Journal):
    """A journal that remembers when it held which line to be executed: in its file, and on the disk."""

    def __init__(self, path: Path, now_s: Callable[[], float]) -> None:
        self.in_file: list[tuple[float, int]] = [(0.0, 0)]
        self.on_disk: list[tuple[float, int]] = [(0.0, 0)]
        self._now_s = now_s
        super().__init__(path, JournalHeading("p.gcode", "", "campaign", {}))

    def write(self, checkpoint: Checkpoint, hurry: bool = False) -> None:
        """Note the time, too. What is not in a hurry reaches the disk once in SYNC_S."""
        super().write(checkpoint, hurry)
        now_s = self._now_s()
        if hurry or now_s - self.on_disk[-1][0] >= SYNC_S:
            self.on_disk.append((now_s, checkpoint.executed if hurry else self.in_file[-1][1]))
        self.in_file.append((now_s, checkpoint.executed))


def count_repeats(build: BuildOptions, lines: list[str], moments: int = 1000, seed: int = 1) -> dict[str, tuple[float, int]]:
    """Strokes that a print would do twice after a power cut: on average of random moments and at the worst one of all, for a
    journal of which the whole file is left, and for one of which the disk's part is left.
    """
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


def show_repeats(moments: int, seed: int) -> None:
    """A row for each program and build."""
    print("| program | Marlin | twice, mean | most | the computer lost its power, too: mean | most |\n|---|---|---|---|---|---|")
    for program_name, lines in (("lifted travels", lifted_program()), ("strokes of 0.25 mm", curved_program())):
        for build in ("stock", "advanced"):
            counts = count_repeats(BuildOptions(advanced_ok=build == "advanced", rx_ring=RING), lines, moments, seed)
            (mean, most), (disk_mean, disk_most) = counts["file"], counts["disk"]
            print(f"| {program_name} | {build} | {mean:.1f} | {most} | {disk_mean:.1f} | {disk_most} |")


def main() -> None:
    """Run the campaign and print a table."""
    if sys.argv[1:2] == ["--printer"]:
        serve(sys.argv[2], sys.argv[3], float(sys.argv[4]))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("moments", type=int, nargs="?", default=200)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("--power", choices=("stock", "advanced"))
    parser.add_argument("--repeats", action="store_true")
    given = parser.parse_args()
    if given.repeats:
        show_repeats(given.moments, given.seed)
        return
    if given.power:
        show_cuts(cut_campaign(given.moments, given.seed, BuildOptions(advanced_ok=given.power == "advanced", rx_ring=RING)))
        return
    results = campaign(given.moments, given.seed)
    print("| what the host found | moments | moves missing | moves made twice, most |\n|---|---|---|---|")
    for how, count in sorted(Counter(result.how for result in results).items()):
        mine = [result for result in results if result.how == how]
        print(f"| {how} | {count} | {sum(r.gap for r in mine)} | {max(r.twice for r in mine)} |")


def show_cuts(cuts: list[Result]) -> None:
    """A row for each kind of end."""
    print("| what the journal told | cuts | moves missing | moves made twice, most | Z wrong by at most, mm |")
    print("|---|---|---|---|---|")
    for how, count in sorted(Counter(cut.how for cut in cuts).items()):
        mine = [cut for cut in cuts if cut.how == how]
        missing, twice = sum(cut.gap for cut in mine), max(cut.twice for cut in mine)
        print(f"| {how} | {count} | {missing} | {twice} | {max(cut.off_mm for cut in mine):.2f} |")


if __name__ == "__main__":
    main()
