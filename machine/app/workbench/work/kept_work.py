"""Kept work: what lies on a bench, in a folder of the state folder, so that a crash or a restart loses nothing of it.

A folder has `work.json`, which names the other files: the model's and those of profiles that are no shipped ones, each a copy of
its own, and the plan. It is written last and as a whole, so a folder without it, or half a folder, is none. A folder is locked
as long as a bench writes to it.
"""

import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from secrets import token_hex
from typing import Any

from machine.app.output import plain_name
from machine.app.requests import Given
from machine.app.workbench.bench.bench import Bench, plan_of_bench
from mdp.plans.writing import plan_text
from profiles.errors import PlanError, reason
from profiles.files import LOCK, lock_folder, whole_file, write_whole
from profiles.folders import state_folder
from profiles.frozen import Vector
from profiles.places import KINDS

VERSION = 1
FOLDER, RECORD, PLAN = "benches", "work.json", "plan.toml"
MOST_KEPT = 10  # the newest ones
DEMO = "demo:"


@dataclass(frozen=True)
class KeptWork:
    """What was on a bench; files are in the folder.

    own_names: of profiles that are files, by their kind, as a person knows them; plan: None where it was neither cut nor marked;
    locked: which of its parts from the second on; pauses, changes: as the options of `export` take them.
    """

    folder: Path
    name: str
    model: Path | None
    written_s: float
    given: Given
    own_names: dict[str, str]
    rotation: tuple[Vector, ...]
    plan: Path | None
    parts: int
    locked: tuple[int, ...]
    pauses: tuple[str, ...]
    changes: tuple[str, ...]
    copies: int


def kept_folder() -> Path:
    """Where all work is kept. Raises OutputError."""
    folder = state_folder() / FOLDER
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def new_folder() -> Path:
    """A folder for the work of one more bench. Raises OSError and OutputError."""
    folder = kept_folder() / f"{time.strftime('%Y%m%d-%H%M%S')}-{token_hex(4)}"
    folder.mkdir(mode=0o700)
    return folder


def write_work(folder: Path, bench: Bench) -> None:
    """Keep what lies on a bench with a model. Raises OSError, then what was kept before is there still."""
    model, given, names = bench.model, bench.given, {RECORD, PLAN, LOCK}
    assert model is not None
    copies: dict[str, str] = {}
    for kind in KINDS:
        if (file := Path(getattr(given, kind))).is_file():
            copies[kind] = _copied(file, folder, kind)
    record = {
        "version": VERSION,
        "written_s": time.time(),
        "name": model.name,
        "model": "" if model.name.startswith(DEMO) else _copied(model.path, folder, "model"),
        "given": {**asdict(given), **copies},
        "own_profiles": {kind: Path(getattr(given, kind)).name for kind in copies},
        "rotation": bench.rotation,
        "plan": bench.planned,
        "parts": bench.parts,
        "locked": [k for k, part in enumerate(bench.cuts or ()) if part in bench.locked],
        "pauses": [stop.option.partition(" ")[2] for stop in bench.stops if not stop.change],
        "changes": [stop.option.partition(" ")[2] for stop in bench.stops if stop.change],
        "copies": bench.copies,
    }
    if bench.planned:
        write_whole(folder / PLAN, plan_text(plan_of_bench(bench, PLAN), folder).encode())
    write_whole(folder / RECORD, json.dumps(record).encode())
    names |= {str(record["model"]), *copies.values()}
    for file in folder.iterdir():
        if file.name not in names:
            file.unlink()


def _copied(file: Path, folder: Path, role: str) -> str:
    """The name in a folder of a copy of a file, which is made where it is not there yet."""
    status = file.stat()
    name = f"{role}-{status.st_mtime_ns:x}-{status.st_size:x}-{plain_name(file.name)}"
    if not (folder / name).exists():
        with file.open("rb") as source, whole_file(folder / name) as copy:
            shutil.copyfileobj(source, copy)
    return name


def read_work(folder: Path) -> KeptWork:
    """What is kept in a folder. Raises PlanError with a sentence where it cannot be read, or not by this version."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        version = record["version"]
        if isinstance(version, int) and version > VERSION:
            raise PlanError(f"this work was kept by a newer tiltprint, which can open it; it stays in {folder}")
        return _work_of(folder, record)
    except OSError as error:
        raise PlanError(f"the work in {folder} cannot be read: {reason(error)}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise PlanError(f"what is kept in {folder} is no work of a workbench, or damaged") from None


def _work_of(folder: Path, record: dict[str, Any]) -> KeptWork:
    given = record["given"]
    own_names = {str(kind): Path(name).name for kind, name in record["own_profiles"].items()}
    own = {kind: str(folder / given[kind]) for kind in own_names}
    return KeptWork(
        folder,
        str(record["name"]),
        folder / record["model"] if record["model"] else None,
        float(record["written_s"]),
        Given(**{**given, **own, "settings": tuple(map(str, given["settings"]))}),
        own_names,
        tuple((float(x), float(y), float(z)) for x, y, z in record["rotation"]),
        folder / PLAN if record["plan"] else None,
        int(record["parts"]),
        tuple(map(int, record["locked"])),
        tuple(map(str, record["pauses"])),
        tuple(map(str, record["changes"])),
        int(record["copies"]),
    )


def folders_kept() -> list[Path]:
    """The folders with work that no bench writes to, the newest first; where more are kept than may be, the oldest go."""
    folders = sorted(_folders(), key=lambda folder: (folder / RECORD).stat().st_mtime, reverse=True)
    for folder in folders[MOST_KEPT:]:
        shutil.rmtree(folder, ignore_errors=True)
    return folders[:MOST_KEPT]


def _folders() -> Iterator[Path]:
    for folder in kept_folder().iterdir():
        with suppress(OSError):
            if (folder / RECORD).is_file() and (lock := lock_folder(folder)) is not None:
                os.close(lock)
                yield folder
