"""Kill a host at random moments of a print and resume from its journal; the printer lives on in another process.

Run: python tools/kill_campaign.py [MOMENTS] [SEED]     (default 200 moments; a run's figures stand in docs/serial.md)
A moment passes when the executed moves, both runs together, are the program's without a gap; what was done twice is counted.
"""

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from pathlib import Path
from time import monotonic, sleep

import numpy as np

from machine.link.journal import Journal, JournalHeading, read_journal
from machine.link.protocol.timeout import Timing
from machine.link.resume import ResumePoint, plan_resume, read_interrupted_print
from machine.link.status import PrinterStatus
from machine.link.stream import print_lines
from machine.reader.gcode_file import GcodeFile
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load

PROFILE = load()
LIMIT = 95
GREETING_S = 0.15  # before that nothing has been sent
QUICK = Timing(drain_s=0.05, quiet_s=0.03)
START = ["G21", "G90", "M83", "M140 S25", "M104 S175", "G28 X Y Z", "G92 A0 C0", "M190 S25", "M109 S175", "G92 E0", "M106 S128"]
POSES = ((0, 0), (30, 725), (-20, 360))
LAYERS, STROKES = 16, 40
SPEED = 500.0  # times real time, of every other printer: its planner is full when the host dies


@dataclass(frozen=True)
class Result:
    """What became of one moment. executed: moves before the second run; first: the program's move with which it began."""

    how: str
    executed: int
    first: int
    moves: int

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
    with SimulatedPrinter(PROFILE.machine, speed, link=Path(link)) as printer:
        print("ready", flush=True)
        sys.stdin.read()
        done = printer.record
        moved = np.column_stack([done.end[:, :5], done.end[:, 5] - done.start[:, 5]])
        Path(record).write_text(json.dumps(moved.round(4).tolist()), encoding="utf-8")


@contextmanager
def printer(folder: Path, speed: float) -> Iterator[Path]:
    """A printer in a process of its own; folder/record.json is there afterwards."""
    link = folder / "tty"
    words = [sys.executable, __file__, "--printer", str(link), str(folder / "record.json"), str(speed)]
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
    with Journal(journal, JournalHeading(str(text.path), text.sha256(), "campaign", {})) as kept:
        print_lines(text, str(port), 250000, timing=QUICK, journal=kept, profile=PROFILE)


def go_on(text: GcodeFile, port: Path, journal: Path, told: Path) -> None:
    """Resume as the command does, without asking; writes down how."""
    story = read_journal(journal)
    point = read_interrupted_print(text, story.last, PROFILE, LIMIT)

    def begin(found: PrinterStatus) -> ResumePoint:
        way = plan_resume(point, found, PROFILE)
        told.write_text(json.dumps([way.start.line, way.reason.partition(":")[0].partition(";")[0]]), encoding="utf-8")
        return way.start

    with Journal(journal.with_suffix(".rest"), story.heading) as kept:
        print_lines(text, str(port), 250000, timing=QUICK, journal=kept, profile=PROFILE, begin=begin)


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
        told = folder / "told"
        if not journal.exists() or not journal.read_bytes():
            begin_print(text, port, folder / "again")
        elif read_journal(journal).finished:
            how = "killed after its end"
        else:
            code = os.waitstatus_to_exitcode(os.waitpid(apart(lambda: go_on(text, port, journal, told)), 0)[1])
            how = json.loads(told.read_text())[1] if told.exists() else "nothing left to do"
            if code and told.exists():
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
    return Result(how, last, len(whole) - tail, len(moves))


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
    chance, found = random.Random(seed), []
    undone = {}
    for speed in (inf, SPEED):
        with tempfile.TemporaryDirectory() as name:
            undone[speed] = undisturbed(Path(name), speed)
    for number in range(moments):
        with tempfile.TemporaryDirectory() as name:
            speed = inf if number % 2 else SPEED
            whole, taken_s = undone[speed]
            found.append(moment(chance.uniform(GREETING_S, taken_s), speed, Path(name), whole))
    return found


def main() -> None:
    """Run the campaign and print a table."""
    if sys.argv[1:2] == ["--printer"]:
        serve(sys.argv[2], sys.argv[3], float(sys.argv[4]))
        return
    given = [int(word) for word in sys.argv[1:]]
    results = campaign(given[0] if given else 200, given[1] if given[1:] else 1)
    print("| what the host found | moments | moves missing | moves made twice, most |\n|---|---|---|---|")
    for how, count in sorted(Counter(result.how for result in results).items()):
        mine = [result for result in results if result.how == how]
        print(f"| {how} | {count} | {sum(r.gap for r in mine)} | {max(r.twice for r in mine)} |")


if __name__ == "__main__":
    main()
