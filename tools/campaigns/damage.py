"""Damage campaign: seeded damage to model files and G-code; every file must be read or refused with a sentence, in time.

    python tools/campaigns/damage.py [--models 600] [--programs 600] [--first 0] [--jobs 2] [--more FOLDER ...]

Models: the shipped ones, written by trimesh in six formats, and those in the folders of --more; programs: of a shipped model,
exported for five machines, and the .gcode files of --more. Each damaged file is read (a program also dry-run) in a process of its
own limited to 20 s and 2 GB. Exits with 1 if one crashed, hung or exceeded the memory, naming its number.
"""

import os
import random
import re
import resource
import signal
import sys
import tempfile
import traceback
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from time import perf_counter

import trimesh

from machine.cli.cli import main as tiltprint
from machine.dryrun import dry_run
from machine.notices import plain_lines
from machine.pipeline.embedded_profile import read_embedded_profile
from machine.pipeline.programs import read_gcode_lines
from mdp.formats.readers import READERS
from mdp.model_file import locate
from mdp.read import read_mesh
from profiles.errors import UserError
from profiles.profile import load
from tools.campaigns.harness import counts, options_of, table, trials

MOST_S, MOST_BYTES = 20, 2 * 2**30
DEMOS = ("bracket", "figure", "lattice", "tree")
MACHINES = ("generic_ac", "gen5x", "linuxcnc_xyzac", "trident_5axis", "fractal5pro")
LINES = 2500  # of a program: its head and a random stretch
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
NASTY = [b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"4294967296", b"9" * 40, b"1e-310", b"1e300"]
NASTY += [b"--1", b"1.2.3", b"", b"\x00"]
READ, REFUSED, CRASHED, LIMITED = "read", "refused", "crashed", "hung or took too much memory"
CODES = {0: READ, 1: REFUSED, 3: CRASHED}


def renumber(content: bytes, dice: random.Random) -> bytes:
    """Replace some numbers by ones that are hard for readers."""
    places = list(NUMBER.finditer(content[:200_000]))
    for match in sorted(dice.sample(places, min(len(places), dice.choice([1, 2, 10]))), key=lambda number: -number.start()):
        content = content[: match.start()] + dice.choice(NASTY) + content[match.end() :]
    return content


def flip(content: bytes, dice: random.Random) -> bytes:
    """Replace some bytes."""
    changed = bytearray(content)
    for _ in range(dice.choice([1, 3, 30, 300])):
        changed[dice.randrange(len(changed))] = dice.randrange(256)
    return bytes(changed)


def one_damage(content: bytes, dice: random.Random) -> bytes:
    """A file that is truncated or changed, or with a stretch missing, repeated, moved, or filled with one byte."""
    begin = dice.randrange(len(content))
    before, stretch, after = content[:begin], content[begin : begin + dice.choice([1, 4, 50, 1000, 20000])], content[begin:]
    after = after[len(stretch) :]
    elsewhere = dice.randrange(len(before + after) + 1)
    kinds: dict[str, Callable[[], bytes]] = {
        "truncated": lambda: before,
        "flipped": lambda: flip(content, dice),
        "lost": lambda: before + after,
        "repeated": lambda: before + stretch * dice.choice([2, 3, 50]) + after,
        "moved": lambda: (before + after)[:elsewhere] + stretch + (before + after)[elsewhere:],
        "filled": lambda: before + dice.choice([b"\x00", b"\xff", b" ", b"\n", b"{"]) * len(stretch) + after,
        "renumbered": lambda: renumber(content, dice),
        "joined": lambda: content + content[begin:],
    }
    return kinds[dice.choice(list(kinds))]()


def damaged(content: bytes, dice: random.Random) -> bytes:
    """A file with one to three damages; for an archive sometimes in its content."""
    if content[:2] == b"PK" and dice.random() < 0.7:
        return _repacked(content, dice)
    for _ in range(dice.choice([1, 1, 2, 3])):
        content = one_damage(content, dice) or b"\n"
    return content


def _repacked(content: bytes, dice: random.Random) -> bytes:
    whole = BytesIO()
    with zipfile.ZipFile(BytesIO(content)) as old, zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            inside = old.read(name)
            new.writestr(name, damaged(inside, dice) if name.endswith(".model") else inside)
    return whole.getvalue()


def model_seeds(folders: Sequence[Path]) -> list[tuple[str, bytes]]:
    """(suffix, content) of intact model files."""
    seeds = [
        (file.suffix.lower(), file.read_bytes())
        for folder in folders
        for file in sorted(folder.iterdir())
        if file.suffix.lower() in READERS
    ]
    for demo in DEMOS:
        mesh = trimesh.load_mesh(locate(f"demo:{demo}"))
        seeds.append((".ply", locate(f"demo:{demo}").read_bytes()))
        for kind in ("stl", "stl_ascii", "obj", "off", "ply", "glb"):
            content = mesh.export(file_type=kind)
            seeds.append((f".{kind.split('_')[0]}", content.encode() if isinstance(content, str) else content))
    return seeds


def program_seeds(folders: Sequence[Path], scratch: Path) -> list[tuple[str, bytes]]:
    """(suffix, content) of intact G-code files."""
    for machine in MACHINES:
        if tiltprint(["export", "demo:bracket", "--parts", "2", "--machine", machine, "-o", str(scratch / f"{machine}.gcode")]):
            raise SystemExit(f"demo:bracket cannot be exported for {machine}")
    files = [file for folder in (scratch, *folders) for file in sorted(folder.glob("*.gcode"))]
    return [(".gcode", file.read_bytes()) for file in files]


def excerpt(content: bytes, dice: random.Random) -> bytes:
    """The head of a program, a random stretch, and its last lines."""
    lines = content.splitlines(keepends=True)
    begin = dice.randrange(len(lines))
    return b"".join([*lines[:400], *lines[begin : begin + LINES], *lines[-400:]])


def read_program(file: Path) -> None:
    """Read a program like `tiltprint simulate`."""
    lines = read_gcode_lines(file)
    profile, _ = read_embedded_profile(lines, load(), frozenset())
    dry_run(lines, profile)


@dataclass(frozen=True)
class Trial:
    """Outcome of one damaged file, its duration, and the message."""

    number: int
    suffix: str
    became: str
    took_s: float
    said: str


def trial(seeds: list[tuple[str, bytes]], read: Callable[[Path], object], scratch: Path, number: int) -> Trial:
    """Damage one of the seeds, determined by the number, and read it in a process of its own."""
    dice = random.Random(number)
    suffix, content = dice.choice(seeds)
    file, said = scratch / f"{number}{suffix}", scratch / f"{number}.txt"
    file.write_bytes(damaged(excerpt(content, dice) if suffix == ".gcode" else content, dice))
    began = perf_counter()
    pid = os.fork()
    if pid == 0:
        signal.alarm(MOST_S)
        resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
        os._exit(_try(read, file, said))
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    took_s = perf_counter() - began
    text = said.read_text(errors="replace") if said.exists() else ""
    file.unlink()
    return Trial(number, suffix, CODES.get(code, LIMITED), took_s, text[-1500:])


def _try(read: Callable[[Path], object], file: Path, report: Path) -> int:
    """Read a file; returns the exit code, and writes the message to a file."""
    with report.open("w") as said:
        os.dup2(said.fileno(), 2)
        try:
            read(file)
        except UserError as error:
            said.write(plain_lines(str(error)))
            return 1
        except BaseException:  # noqa: BLE001 - every error is a result here
            traceback.print_exc(file=said)
            return 3
    return 0


def main() -> None:
    """Read the options, run both campaigns."""
    parser = options_of(__doc__, models=600, programs=600, first=0, jobs=2)
    parser.add_argument("--more", type=Path, nargs="*", default=[])
    given, done = parser.parse_args(), list[Trial]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        models, programs = partial(model_seeds, given.more), partial(program_seeds, given.more, folder)
        for count, seeds, read in ((given.models, models, read_mesh), (given.programs, programs, read_program)):
            if count:
                done += trials(partial(trial, seeds(), read, folder), given.first, count, given.jobs)
    columns = counts((READ, REFUSED, CRASHED, LIMITED), lambda trial: trial.became)
    columns["longest s"] = lambda mine: f"{max(trial.took_s for trial in mine):.1f}"
    print(table(done, "files", lambda trial: trial.suffix, columns))
    wrong = [one for one in done if one.became in (CRASHED, LIMITED)]
    print("\n".join(f"number {one.number}, {one.suffix}: {one.became}\n{one.said}" for one in wrong))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
