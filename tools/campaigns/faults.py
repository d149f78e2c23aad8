"""Faults of the serial line: seeded random faults in prints on the simulated printer, every one judged.

    python tools/campaigns/faults.py [--scripts 1000] [--first 0] [--lines 2000] [--jobs 2]

A print must end with exactly the program's strokes, each once and in order, or with the error that matches its faults and a safe
machine: heaters off by the printer's own report, nothing moving; or, if the printer is unreachable, with a message that says so.
Sender and printer share a virtual clock: a print takes a second and is reproducible.
"""

import random
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import KINDS, Fault, FaultScript
from machine.simulator.record import Record
from profiles.errors import PrinterError
from profiles.profile import load
from tests.machine.virtual_printer import HEALED, PATH, EndlessError, VirtualPrinter, random_script
from tools.campaigns.harness import options_of, trials
from tools.campaigns.harness import table as grouped

PROFILE = load()
# Firmwares without resends, over a line that loses none of their bytes.
NEVER = ("drop", "flip", "duplicate", "delay", "spurious resend", "silent reset")  # of USB: a board that restarts is gone
TRUSTING = {5: load(settings=["machine.dialect=klipper"]), 13: load(settings=["machine.dialect=reprapfirmware"])}
HEAT = ["M104 S200", "M109 S200", "G92 E0", "M83"]
COLD = ["M104 S0", "M140 S0", "M107"]
MOST_S = 7200.0  # twenty times the duration of a print; a host that needs more hangs
AFTER_S = 900.0  # observation after the end
OF_THE_LINE = ("too noisy", "torn line", "asks for line", "restarted without a word", "has been silent")
# Possible words of an error, by the kinds of faults in its script.
WORDS: dict[str, tuple[str, ...]] = {
    "error": ("Heating failed",),
    **dict.fromkeys(("reset", "silent reset"), ("restarted", "stands at")),
    "disconnect": ("was lost", "did not come back", "was not answered", "stands at"),
    "stall": ("has been silent", "no temperature"),
    "block": ("has been silent", "has stopped reading", "no temperature"),
    "heater failure": ("its heater or", "Thermal Runaway", "Heating failed", "nozzle is too cold", "below minimum temp"),
    "thermal runaway": ("Thermal Runaway", "halted"),
    **dict.fromkeys(("swallow ok", "truncate ok", "garbage"), ("was not answered",)),
}
UNREACHABLE = "may still be on"


@dataclass(frozen=True)
class Trial:
    """One print: the kinds of its faults, its error ("": none), and what is wrong about that."""

    seed: int
    dialect: str
    kinds: tuple[str, ...]
    error: str
    virtual_s: float
    repeated: int
    wrong: tuple[str, ...]

    @property
    def name(self) -> str:
        """Its group in the table."""
        deadly = [kind for kind in self.kinds if kind not in (*HEALED, "delay")]
        if self.dialect != "marlin":
            return f"{self.dialect}: all but lost bytes"
        if not deadly:
            return "bytes, oks, delays, false resends"
        return f"with {deadly[0]}" if len(deadly) == 1 else "with several of these"


def program(lines: int) -> list[str]:
    """Heating and a number of strokes, all different."""
    strokes = [
        f"G1 X{20 + k % 60}.{k % 1000:03d} Y{30 + k % 41}.5 E0.{10000 + k:05d} F6000"
        for k in range(lines - len(HEAT) - len(COLD))
    ]
    return [*HEAT, *strokes, *COLD]


def wanted(lines: Iterable[str]) -> np.ndarray:
    """(n, 3) X, Y and filament of the program's strokes."""
    return np.array([[float(word[1:]) for word in line.split()[1:4]] for line in lines if line.startswith("G1")])


def script(seed: int, lines: int) -> FaultScript:
    """One to twelve faults of up to four kinds; a third of the scripts only has curable ones, a tenth faults by chance."""
    rng = random.Random(seed)
    if seed % 16 in TRUSTING:
        safe = [kind for kind in KINDS if kind not in NEVER]
        return random_script(seed, rng.randint(1, 3), range(5, lines), rng.sample(safe, rng.randint(1, 3)))
    if seed % 10 == 7:
        chances = [Fault(kind, chance=rng.uniform(1e-5, 2e-4)) for kind in ("drop", "flip", "duplicate")]
        oks = [Fault(kind, chance=rng.uniform(1e-3, 1e-2)) for kind in ("swallow ok", "truncate ok", "double ok")]
        return FaultScript((*chances, *(Fault(f.kind, chance=f.chance, to_host=True) for f in chances), *oks), seed)
    kinds = (*HEALED, "delay") if seed % 3 == 0 else rng.sample(KINDS, rng.randint(1, 4))
    return random_script(seed, rng.randint(1, 12), range(5, lines), kinds)


def build_options(seed: int) -> BuildOptions:
    """The printer's build options of a trial."""
    rng = random.Random(~seed)
    return BuildOptions(*(rng.random() < share for share in (0.5, 0.7, 0.8, 0.7)), rx_ring=128 if seed % 2 else None)


def trial(seed: int, lines: int) -> Trial:
    """Print once and judge the result."""
    text, faults = program(lines), script(seed, lines)
    profile = TRUSTING.get(seed % 16, PROFILE)
    baud = None if profile is not PROFILE else (None, None, 250000, 115200)[seed % 4]
    printer = VirtualPrinter(profile.machine, build_options(seed), faults, baud, MOST_S)
    error, repeated = "", 0
    try:
        repeated = print_lines(text, PATH, medium=printer.medium, profile=profile).repeated
    except PrinterError as stopped:
        error = str(stopped)
    except EndlessError:
        error = "hangs"
    end_s = printer.now_s
    wrong = [] if error == "hangs" else judged(text, faults, printer, error)
    wrong += ["hangs"] if error == "hangs" else []
    kinds = tuple(sorted({fault.kind for fault in faults.faults}))
    return Trial(seed, profile.machine.dialect, kinds, error, end_s, repeated, tuple(wrong))


def judged(text: list[str], faults: FaultScript, printer: VirtualPrinter, error: str) -> list[str]:
    """The faults of an end."""
    end_s = printer.now_s
    printer.firmware.advance(end_s + AFTER_S)
    record, strokes = printer.record, wanted(text)
    wrong = order(record, strokes, whole=not error)
    if not error:
        return wrong
    kinds = {fault.kind for fault in faults.faults}
    allowed = {*OF_THE_LINE, *(word for kind in kinds for word in WORDS.get(kind, ()))}
    wrong += [] if any(word in error for word in allowed) else [f"not the right error: {error}"]
    if UNREACHABLE not in error:
        wrong += ["a heater is on"] if record.nozzle_target_c or record.bed_target_c else []
        wrong += ["moves after the end"] if len(record.end) and record.begin_s[-1] > end_s + 5.0 else []
    elif not {"disconnect", "stall", "block", "reset", "silent reset", "thermal runaway", "error"} & kinds:
        wrong += ["a printer within reach was left with its heaters on"] if record.nozzle_target_c else []
    return wrong


def order(record: Record, strokes: np.ndarray, whole: bool) -> list[str]:
    """Faults of the executed strokes, which must be the program's, each once and in order; a stop may shorten the last."""
    pushed = record.end[:, 5] - record.start[:, 5]
    got = np.column_stack([record.end[:, :2], pushed])[pushed > 1e-9]
    if whole and len(got) != len(strokes):
        return [f"{len(got)} of {len(strokes)} strokes without an error"]
    if len(got) > len(strokes):
        return [f"{len(got)} strokes, the program has {len(strokes)}"]
    far = np.abs(got - strokes[: len(got)]).max(axis=1) > 1e-6
    if far[:-1].any() or (len(far) and far[-1] and (whole or got[-1, 2] > strokes[len(got) - 1, 2])):
        return [f"stroke {int(np.flatnonzero(far)[0]) + 1} is not the program's"]
    return []


def table(trials: list[Trial]) -> str:
    """Table with a row for every group of scripts."""
    columns = {
        "scripts": len,
        "exact": lambda mine: sum(not (trial.wrong or trial.error) for trial in mine),
        "stopped": lambda mine: sum(bool(trial.error) and not trial.wrong for trial in mine),
        "wrong": lambda mine: sum(bool(trial.wrong) for trial in mine),
        "slowest, virtual s": lambda mine: round(max(trial.virtual_s for trial in mine)),
    }
    return grouped(trials, "faults", lambda trial: trial.name, columns)


def reasons(trials: list[Trial]) -> str:
    """Counts of the messages with which prints were stopped."""
    words = Counter(re.sub(r"[\d.]+|N\d+", "#", trial.error.partition(";")[0])[:90] for trial in trials if trial.error)
    return "\n".join(f"{count:5d}  {text}" for text, count in words.most_common())


def main() -> None:
    """Run the campaign and print its table."""
    asked = options_of(__doc__, scripts=1000, first=0, lines=2000, jobs=2).parse_args()
    done = []
    for one in trials(partial(trial, lines=asked.lines), asked.first, asked.scripts, asked.jobs):
        done.append(one)
        for text in one.wrong:
            print(f"seed {one.seed} ({', '.join(one.kinds)}): {text}", flush=True)
    print(f"{table(done)}\n\n{reasons(done)}")
    raise SystemExit(any(one.wrong for one in done))


if __name__ == "__main__":
    main()
