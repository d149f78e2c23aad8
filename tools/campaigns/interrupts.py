"""Interrupts: how long commands take to end after Ctrl-C at many moments, and what they leave running after any signal.

    python tools/campaigns/interrupts.py MODEL... [--moments 8] [--signals GROUP INT TERM KILL] [--commands export print]

GROUP is Ctrl-C, which a terminal sends to the whole process group; INT, TERM and KILL reach only the command itself. Two seconds
later no process of its session may be left. Exits with 1 if an end took longer than 2 s, had another exit code or left a process.
"""

import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from time import monotonic, sleep

from tools.bench.harness import OURS
from tools.campaigns.harness import options_of, table

MOST_S = 2.0
SIGNALS = {"GROUP": signal.SIGINT, "INT": signal.SIGINT, "TERM": signal.SIGTERM, "KILL": signal.SIGKILL}
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
    """How a command ended: duration, exit code, last output, number of processes left; row: command and signal."""

    after_s: float
    code: int
    words: str
    left: int
    row: str = ""

    @property
    def is_wrong(self) -> bool:
        """Whether it was late, had a wrong exit code, or left processes; a command that had already ended is right."""
        codes = {"GROUP": (130, 0), "INT": (130, 0), "TERM": (143, 130, -signal.SIGTERM, 0), "KILL": (-signal.SIGKILL, 0)}
        return self.after_s > MOST_S or self.code not in codes[self.row.rpartition(" ")[2]] or self.left > 0


def main() -> None:
    """Run all commands on all models, first to their ends, then interrupted at moments spread over that time."""
    parser = options_of(__doc__, moments=8)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--signals", nargs="+", default=["GROUP"], choices=list(SIGNALS))
    parser.add_argument("--commands", nargs="+", default=list(COMMANDS), choices=list(COMMANDS))
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))
    ends = list[End]()
    for model, command in product(asked.models, asked.commands):
        whole_s = run(command, model, None, 1e9).after_s
        for name, k in product(asked.signals, range(asked.moments)):
            moment_s = whole_s * (k + 0.5) / asked.moments
            row = f"{command} of {Path(model).name}, {whole_s:.0f} s, {name}"
            end = replace(run(command, model, name, moment_s), row=row)
            ends.append(end)
            if end.is_wrong:
                print(f"at {moment_s:.1f} s: {end}", flush=True)
    columns = {
        "moments": len,
        "wrong": lambda mine: sum(end.is_wrong for end in mine),
        "longest s until the end": lambda mine: f"{max(end.after_s for end in mine):.2f}",
    }
    print(table(ends, "command and signal", lambda end: end.row, columns))
    raise SystemExit(any(end.is_wrong for end in ends))


def run(command: str, model: str, name: str | None, moment_s: float) -> End:
    """Start a command in a session of its own, send it a signal at a moment, and wait for its end."""
    with tempfile.TemporaryDirectory() as out, tempfile.TemporaryFile() as words:
        line = [word.format(model=model, out=out) for word in COMMANDS[command]]
        began = monotonic()
        process = subprocess.Popen([*OURS, *line], stdout=subprocess.DEVNULL, stderr=words, start_new_session=True)
        try:
            process.wait(None if name is None else moment_s)
        except subprocess.TimeoutExpired:
            assert name is not None
            began = monotonic()
            (os.killpg if name == "GROUP" else os.kill)(process.pid, SIGNALS[name])
            process.wait()
        finally:
            process.kill()  # if the campaign itself is interrupted
        after_s = monotonic() - began if name is None or process.returncode else 0.0
        sleep(0.1)
        if left := session(process.pid):
            sleep(MOST_S)
            left = session(process.pid)
        for pid in left:
            os.kill(pid, signal.SIGKILL)
        words.seek(0)
        last_words = words.read().decode(errors="replace").strip().rpartition("\n")[2][:200]
        return End(after_s, process.returncode, last_words, len(left))


def session(number: int) -> list[int]:
    """The processes of a session, without zombies."""
    listed = subprocess.run(["ps", "-eo", "pid,sid,stat"], capture_output=True, text=True, check=True).stdout.splitlines()[1:]
    return [int(pid) for pid, session, state in map(str.split, listed) if int(session) == number and state[0] != "Z"]


if __name__ == "__main__":
    main()
