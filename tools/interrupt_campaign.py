"""Interrupts: how long commands take to end after Ctrl-C at many moments, and what they leave running after any signal.

    python tools/interrupt_campaign.py MODEL... [--moments 8] [--signals GROUP INT TERM KILL] [--commands export print]

GROUP is Ctrl-C, which reaches the whole group of processes as a terminal sends it; INT, TERM and KILL reach only the command
itself. Two seconds later no process of its session may be left. Exits with 1 where one end took longer than 2 s, had another
code or left a process.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

MOST_S = 2.0
SIGNALS = {"GROUP": signal.SIGINT, "INT": signal.SIGINT, "TERM": signal.SIGTERM, "KILL": signal.SIGKILL}
START = [sys.executable, "-c", "from machine.cli.start import main; raise SystemExit(main())"]
COMMANDS = {
    "decompose": ["decompose", "{model}", "--set", "search.beam_width=10"],
    "as is": ["decompose", "{model}", "--as-is"],
    "pictures": ["decompose", "{model}", "--parts", "2", "--png", "{out}/a.png", "--sheet", "{out}/b.png", "-o", "{out}/parts"],
    "export": ["export", "{model}", "-o", "{out}/a.gcode"],
    "one part": ["export", "{model}", "-o", "{out}/a.gcode", "--parts", "1"],
    "compare": ["export", "{model}", "-o", "{out}/a.gcode", "--parts", "2", "--compare"],
    "simulate": ["simulate", "{model}"],
    "view": ["view", "{model}", "-o", "{out}/a.html"],
    "print": ["print", "{model}", "--port", "sim"],
}


@dataclass(frozen=True)
class End:
    """How a command ended: after how long, with which code, its last words, and how many processes it left."""

    after_s: float
    code: int
    words: str
    left: int


def main() -> None:
    """Run all commands on all models, first to their ends, then interrupted at moments spread over that time."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--moments", type=int, default=8)
    parser.add_argument("--signals", nargs="+", default=["GROUP"], choices=list(SIGNALS))
    parser.add_argument("--commands", nargs="+", default=list(COMMANDS), choices=list(COMMANDS))
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))
    bad = 0
    for model in asked.models:
        for command in asked.commands:
            whole_s = run(command, model, None, 1e9).after_s
            for name in asked.signals:
                moments = [whole_s * (k + 0.5) / asked.moments for k in range(asked.moments)]
                ends = [(moment, run(command, model, name, moment)) for moment in moments]
                wrong = [(moment, end) for moment, end in ends if is_wrong(end, name)]
                longest_s = max(end.after_s for _, end in ends)
                print(f"{Path(model).name} {command} {name}: {len(ends)} moments of {whole_s:.0f} s, at most {longest_s:.2f} s")
                for moment, end in wrong:
                    print(f"  at {moment:.1f} s: {end.after_s:.2f} s, code {end.code}, {end.left} left, {end.words!r}")
                bad += len(wrong)
                sys.stdout.flush()
    raise SystemExit(1 if bad else 0)


def is_wrong(end: End, name: str) -> bool:
    """Whether an end was late, had another code than it should, or left processes; one that was already done is right."""
    codes = {"GROUP": (130, 0), "INT": (130, 0), "TERM": (143, 130, -signal.SIGTERM, 0), "KILL": (-signal.SIGKILL, 0)}[name]
    return end.after_s > MOST_S or end.code not in codes or end.left > 0


def run(command: str, model: str, name: str | None, moment_s: float) -> End:
    """Start a command in a session of its own, send it a signal at a moment, and wait for its end."""
    with tempfile.TemporaryDirectory() as out, tempfile.TemporaryFile() as words:
        line = [word.format(model=model, out=out) for word in COMMANDS[command]]
        began = monotonic()
        process = subprocess.Popen([*START, *line], stdout=subprocess.DEVNULL, stderr=words, start_new_session=True)
        try:
            process.wait(None if name is None else moment_s)
        except subprocess.TimeoutExpired:
            assert name is not None
            began = monotonic()
            if name == "GROUP":
                os.killpg(process.pid, SIGNALS[name])
            else:
                process.send_signal(SIGNALS[name])
            process.wait()
        finally:
            process.kill()  # where the campaign itself is interrupted
        after_s = monotonic() - began if name is None or process.returncode else 0.0
        sleep(0.1)
        left = session(process.pid)
        if left:
            sleep(MOST_S)
            left = session(process.pid)
        for pid in left:
            os.kill(pid, signal.SIGKILL)
        words.seek(0)
        return End(
            after_s, process.returncode, words.read().decode(errors="replace").strip().rpartition("\n")[2][:200], len(left)
        )


def session(number: int) -> list[int]:
    """The processes of a session that are no zombies."""
    pids = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == number and fields[0] != "Z":
            pids.append(int(folder.name))
    return pids


if __name__ == "__main__":
    main()
