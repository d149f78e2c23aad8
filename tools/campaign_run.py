"""One run of the print campaign: a model printed by the real program in a process of its own, and what became of it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from json import loads
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import Any

from tools.campaign_runs import Run, model_file, options_of
from tools.print_look import look_at

ROOT = Path(__file__).resolve().parents[1]
PRINTED, REFUSED, FINDINGS, BUG, KILLED = OUTCOMES = ("printed", "refused", "findings", "bug", "killed")
# As the command `tiltprint` begins, within limits that hold even where nobody watches any more.
BEGIN = (
    "import resource as r, sys; r.setrlimit(r.RLIMIT_CPU, ({0}, {0} + 5)); r.setrlimit(r.RLIMIT_DATA, ({1}, {1})); "
    "from machine.cli.start import main; sys.exit(main())"
)
BUSY = 3.0  # other work may let a run take this many times its core seconds
POLL_S = 0.05
DRY_RUN_SAYS = "the dry run found"
NO_MEMORY = ("MemoryError", "allocate", "bad_alloc", "Cannot allocate memory")


@dataclass(frozen=True)
class Limits:
    """Core seconds and bytes that a run may take; begin_before: seconds since the epoch after which none is begun."""

    core_s: int = 600
    memory_bytes: int = 8 * 2**30
    begin_before: float = float("inf")


@dataclass(frozen=True)
class Ended:
    """How a process ended: exit code (negative: by a signal), what it said on stderr, seconds, core seconds, peak memory."""

    code: int
    said: str
    wall_s: float
    core_s: float
    memory_mb: float

    @property
    def sentence(self) -> str:
        """The last thing that it said as tiltprint."""
        said = [line for line in self.said.splitlines() if line.startswith("tiltprint: ")]
        return said[-1].removeprefix("tiltprint: ") if said else "\n".join(self.said.splitlines()[-2:])[-300:]

    @property
    def outcome(self) -> str:
        """One of OUTCOMES."""
        if self.code == 0:
            return PRINTED
        if self.code == 1:
            return FINDINGS if self.sentence.startswith(DRY_RUN_SAYS) else REFUSED
        by_limit = self.code in (-signal.SIGXCPU, -signal.SIGKILL) or any(word in self.said for word in NO_MEMORY)
        return KILLED if by_limit else BUG


def tiltprint(arguments: Sequence[str], folder: Path, limits: Limits) -> Ended:
    """Run the command line in a folder."""
    begin = BEGIN.format(limits.core_s, limits.memory_bytes)
    surroundings = os.environ | {"PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(folder)}
    began, said = time.monotonic(), folder / "said.txt"
    with said.open("wb") as heard:
        process = subprocess.Popen(
            [sys.executable, "-c", begin, *arguments],
            cwd=folder,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=heard,
            start_new_session=True,
        )
        pid, status, used = os.wait4(process.pid, os.WNOHANG)
        memory_mb = 0.0
        while not pid:
            memory_mb = max(memory_mb, peak_mb(process.pid))
            if time.monotonic() > began + BUSY * limits.core_s:
                os.killpg(process.pid, signal.SIGKILL)
            time.sleep(POLL_S)
            pid, status, used = os.wait4(process.pid, os.WNOHANG)
    process.returncode = os.waitstatus_to_exitcode(status)
    core_s = used.ru_utime + used.ru_stime
    text = said.read_text(errors="replace")
    return Ended(process.returncode, text, time.monotonic() - began, core_s, memory_mb)


def peak_mb(pid: int) -> float:
    """The most memory that a process has taken so far; what wait4 tells begins with what its parent had when it forked."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    return float(next((line.split()[1] for line in status.splitlines() if line.startswith("VmHWM:")), 0)) / 1024


def run_print(run: Run, out: Path, limits: Limits, keep: bool) -> dict[str, Any] | None:
    """Print a model: the line of runs.jsonl. The G-code of what is refused or suspect is kept in out/kept. None: too late."""
    if time.time() > limits.begin_before:
        return None
    with TemporaryDirectory() as name:
        folder = Path(name)
        file = model_file(run, folder)
        options = options_of(run, file)
        gcode, figures = folder / "print.gcode", folder / "figures.json"
        command = ["export", str(file), "-o", str(gcode), "--json", str(figures), *options]
        ended = tiltprint(command, folder, limits)
        record: dict[str, Any] = {"name": run.name, "group": run.group, "outcome": ended.outcome, "options": " ".join(options)}
        record |= {"code": ended.code, "sentence": "" if ended.code == 0 else ended.sentence, "wall_s": round(ended.wall_s, 2)}
        record |= {"core_s": round(ended.core_s, 2), "memory_mb": round(ended.memory_mb)}
        if ended.outcome == FINDINGS:  # printed all the same, to hear them all
            tiltprint([*command, "--force"], folder, limits)
        if ended.outcome == BUG:
            record["log"] = "".join(log.read_text()[-1500:] for log in folder.rglob("bug-*.log")) or ended.said[-1500:]
        if gcode.exists() and figures.exists():
            record |= looked_at(gcode, loads(figures.read_text()))
        if gcode.exists() and (keep or ended.outcome != PRINTED or record["suspect"]):
            (out / "kept").mkdir(parents=True, exist_ok=True)
            copyfile(gcode, out / "kept" / (run.name.replace("/", "_") + ".gcode"))
    return record


def looked_at(gcode: Path, figures: dict[str, Any]) -> dict[str, Any]:
    """What the dry run and the look of our own say of a program."""
    began, lines = time.process_time(), gcode.read_text().split("\n")
    look = look_at(lines)
    return {
        "lines": len(lines),
        "parts": figures["parts"],
        "layers": figures["layers"],
        "time_s": round(figures["time_s"]),
        "findings": [finding for finding in figures["findings"] if finding["severity"] == "error"],
        "warnings": sorted({finding["code"] for finding in figures["findings"] if finding["severity"] != "error"}),
        "look": look.figures,
        "suspect": look.suspect,
        "look_s": round(time.process_time() - began, 2),
    }
