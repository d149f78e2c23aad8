"""Damage campaign: seeded damage to model files and G-code; every file must be read or refused with a sentence, soon.

    python tools/damage_campaign.py [--models 600] [--programs 600] [--first 0] [--jobs 2] [--more FOLDER ...]

Models: those that ship, written by trimesh in six formats, and those of the folders of --more; programs: of one that ships,
exported for five machines, and the .gcode files of --more. Each damaged file is read in a process of its own (a program is
dry-run as well) that may take 20 s and 2 GB. Exits with 1 where one crashed, hung or took more memory, naming its number.
"""

import argparse
import os
import random
import re
import resource
import signal
import sys
import tempfile
import traceback
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from multiprocessing import get_context
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

MOST_S, MOST_BYTES = 20, 2 * 2**30
DEMOS, MACHINES = (
    ("bracket", "figure", "lattice", "tree"),
    ("generic_ac", "gen5x", "linuxcnc_xyzac", "trident_5axis", "fractal5pro"),
)
LINES = 2500  # of a program: its head and a stretch from anywhere
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
NASTY = [
    b"nan",
    b"inf",
    b"-inf",
    b"1e999",
    b"-1",
    b"0",
    b"4294967296",
    b"9" * 40,
    b"1e-310",
    b"1e300",
    b"--1",
    b"1.2.3",
    b"",
    b"\x00",
]
READ, REFUSED, CRASHED, LIMITED = "read", "refused", "crashed", "hung or took too much memory"
CODES = {0: READ, 1: REFUSED, 3: CRASHED}


def truncate(content: bytes, dice: random.Random) -> bytes:
    """Its beginning only."""
    return content[: dice.randrange(len(content))]


def flip(content: bytes, dice: random.Random) -> bytes:
    """Some bytes are others."""
    damaged = bytearray(content)
    for _ in range(dice.choice([1, 3, 30, 300])):
        damaged[dice.randrange(len(damaged))] = dice.randrange(256)
    return bytes(damaged)


def span(content: bytes, dice: random.Random) -> tuple[int, int]:
    """Where a stretch of it begins and ends."""
    begin = dice.randrange(len(content))
    return begin, min(len(content), begin + dice.choice([1, 4, 50, 1000, 20000]))


def lose(content: bytes, dice: random.Random) -> bytes:
    """A stretch is missing."""
    begin, end = span(content, dice)
    return content[:begin] + content[end:]


def repeat(content: bytes, dice: random.Random) -> bytes:
    """A stretch comes more than once."""
    begin, end = span(content, dice)
    return content[:begin] + content[begin:end] * dice.choice([2, 3, 50]) + content[end:]


def move(content: bytes, dice: random.Random) -> bytes:
    """A stretch stands elsewhere."""
    begin, end = span(content, dice)
    rest = content[:begin] + content[end:]
    begin_at = dice.randrange(len(rest) + 1)
    return rest[:begin_at] + content[begin:end] + rest[begin_at:]


def fill(content: bytes, dice: random.Random) -> bytes:
    """A stretch is of one byte."""
    begin, end = span(content, dice)
    return content[:begin] + dice.choice([b"\x00", b"\xff", b" ", b"\n", b"{"]) * (end - begin) + content[end:]


def renumber(content: bytes, dice: random.Random) -> bytes:
    """Some numbers are others that readers stumble over."""
    places = list(NUMBER.finditer(content[:200_000]))
    for match in sorted(dice.sample(places, min(len(places), dice.choice([1, 2, 10]))), key=lambda number: -number.start()):
        content = content[: match.start()] + dice.choice(NASTY) + content[match.end() :]
    return content


def join(content: bytes, dice: random.Random) -> bytes:
    """The file twice, the second time from anywhere."""
    return content + content[dice.randrange(len(content)) :]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (truncate, flip, lose, repeat, move, fill, renumber, join)


def damaged(content: bytes, dice: random.Random) -> bytes:
    """A file with one to three damages; of an archive sometimes what is packed in it."""
    if content[:2] == b"PK" and dice.random() < 0.7:
        return _repacked(content, dice)
    for _ in range(dice.choice([1, 1, 2, 3])):
        content = dice.choice(DAMAGES)(content, dice) or b"\n"
    return content


def _repacked(content: bytes, dice: random.Random) -> bytes:
    whole = BytesIO()
    with zipfile.ZipFile(BytesIO(content)) as old, zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            inside = old.read(name)
            new.writestr(name, damaged(inside, dice) if name.endswith(".model") else inside)
    return whole.getvalue()


def model_seeds(folders: Sequence[Path]) -> list[tuple[str, bytes]]:
    """(suffix, content) of whole model files."""
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
    """(suffix, content) of whole G-code files."""
    for machine in MACHINES:
        if tiltprint(["export", "demo:bracket", "--parts", "2", "--machine", machine, "-o", str(scratch / f"{machine}.gcode")]):
            raise SystemExit(f"demo:bracket cannot be exported for {machine}")
    files = [file for folder in (scratch, *folders) for file in sorted(folder.glob("*.gcode"))]
    return [(".gcode", file.read_bytes()) for file in files]


def excerpt(content: bytes, dice: random.Random) -> bytes:
    """The head of a program, a stretch from anywhere, and its last lines."""
    lines = content.splitlines(keepends=True)
    begin = dice.randrange(len(lines))
    return b"".join([*lines[:400], *lines[begin : begin + LINES], *lines[-400:]])


def read_model(file: Path) -> None:
    """As every command reads a model."""
    read_mesh(file)


def read_program(file: Path) -> None:
    """As `tiltprint simulate` reads a program."""
    lines = read_gcode_lines(file)
    profile, _ = read_embedded_profile(lines, load(), frozenset())
    dry_run(lines, profile)


def outcome(read: Callable[[Path], None], file: Path) -> str:
    """What becomes of a file in a process of its own; what it says of a crash stands beside the file."""
    pid = os.fork()
    if pid == 0:
        signal.alarm(MOST_S)
        resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
        os._exit(_try(read, file))
    _, status = os.waitpid(pid, 0)
    return CODES.get(os.waitstatus_to_exitcode(status), LIMITED)


def _try(read: Callable[[Path], None], file: Path) -> int:
    with file.with_suffix(".txt").open("w") as said:
        os.dup2(said.fileno(), 2)
        try:
            read(file)
        except UserError as error:
            said.write(plain_lines(str(error)))
            return 1
        except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
            traceback.print_exc(file=said)
            return 3
    return 0


@dataclass(frozen=True)
class Trial:
    """What became of one damaged file, after how long, and what was said."""

    number: int
    suffix: str
    became: str
    took_s: float
    said: str


def trial(seeds: list[tuple[str, bytes]], read: Callable[[Path], None], scratch: Path, number: int) -> Trial:
    """Damage one of the seeds as its number says, and read it."""
    dice = random.Random(number)
    suffix, content = dice.choice(seeds)
    file = scratch / f"{number}{suffix}"
    file.write_bytes(damaged(excerpt(content, dice) if suffix == ".gcode" else content, dice))
    began = perf_counter()
    became = outcome(read, file)
    took_s = perf_counter() - began
    said = file.with_suffix(".txt")
    text = said.read_text(errors="replace") if said.exists() else ""
    file.unlink()
    return Trial(number, suffix, became, took_s, text[-1500:])


def campaign(seeds: list[tuple[str, bytes]], read: Callable[[Path], None], numbers: range, jobs: int, scratch: Path) -> list[str]:
    """Print what became of how many files, and how long the longest took; returns what went wrong."""
    # Processes, not threads: a process forked while another thread holds a lock waits for that lock for ever.
    with ProcessPoolExecutor(jobs, get_context("fork")) as pool:
        trials = list(pool.map(partial(trial, seeds, read, scratch), numbers, chunksize=50))
    counts = Counter((shot.suffix, shot.became) for shot in trials)
    print(", ".join(f"{suffix} {became}: {count}" for (suffix, became), count in sorted(counts.items())))
    longest = max(trials, key=lambda shot: shot.took_s)
    print(f"{len(trials)} files, number {longest.number} ({longest.suffix}) took longest: {longest.took_s:.1f} s", flush=True)
    return [f"number {t.number}, {t.suffix}: {t.became}\n{t.said}" for t in trials if t.became in (CRASHED, LIMITED)]


def wrong(given: argparse.Namespace) -> Iterator[str]:
    """Everything that went wrong, models first."""
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        if given.models:
            yield from campaign(
                model_seeds(given.more), read_model, range(given.first, given.first + given.models), given.jobs, scratch
            )
        if given.programs:
            seeds = program_seeds(given.more, scratch)
            yield from campaign(seeds, read_program, range(given.first, given.first + given.programs), given.jobs, scratch)


def main() -> None:
    """Read the options, run both campaigns."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, number in {"models": 600, "programs": 600, "first": 0, "jobs": 2}.items():
        options.add_argument(f"--{name}", type=int, default=number)
    options.add_argument("--more", type=Path, nargs="*", default=[])
    failures = list(wrong(options.parse_args()))
    print("\n".join(failures) or "none crashed, none hung")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
