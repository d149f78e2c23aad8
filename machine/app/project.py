"""Project: a model with all that decides its print: plan, marks, profiles, placement, pauses, copies.

A project's folder holds `work.json`, which says what was asked for and names the other files: the model's file as it was, the
plan, meshes of modifiers, and profiles that do not ship with the program. The workbench keeps its work in such folders. A project
file is a 3MF of the model as it lies, which any slicer opens, with a picture and the folder's files under Metadata/tiltprint.
"""

import hashlib
import io
import json
import os
import re
import shutil
import zipfile
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from time import time
from typing import Any

import numpy as np

from machine.app.output import plain_name
from machine.app.profile_file import profile_text
from machine.app.requests import MOST_COPIES, Given, ModelRequest
from machine.planning.stops import Stop, parse_stops
from mdp.decomposition import FrontRow
from mdp.mesh import Mesh
from mdp.model_file import DEMO
from mdp.plans.plan_file import ZONE_KINDS, PlanFile
from mdp.plans.writing import plan_text
from mdp.save import MODEL_PART, model_xml, write_package
from mdp.zone import MeshVolume
from profiles.errors import PlanError, SliceError, reason
from profiles.files import DAMAGED_ZIP, lock_folder, remove_locked, whole_file, write_whole
from profiles.frozen import Vector
from profiles.places import KINDS, PARENT, is_file_name, own, shipped
from profiles.toml_text import read_toml

VERSION = 1
STANDING: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))  # as the model is read
RECORD, PLAN = "work.json", "plan.toml"
INSIDE, THUMBNAIL = "Metadata/tiltprint/", "Metadata/thumbnail.png"
PICTURE_PX = (256, 256)
MESH_DIGEST = "mesh.sha256"  # of the 3MF's model part, to see whether another program has changed it
PROGRAM = f"tiltprint {version('tiltprint')}"
SUFFIX = ".3mf"
FILE_NAME = re.compile(r"(?!\.)[\w.+-]{1,240}")  # of a file in a project: in no other folder, on any disk
ADDED = re.compile(rf"^(model|modifier|{'|'.join(KINDS)})-[0-9a-f]{{12}}-")  # to the names of a project's files
LONGEST_NAME = 255  # bytes of a file's name on any disk
MOST_FILES, LARGEST_BYTES = 100, 2**30  # of a project: a zip of a few kB can unpack to more than any disk
BAD_RECORD = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError, SliceError)
DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, *BAD_RECORD, OSError)
PREFIX = "tiltprint-project-"  # of temporary folders
BEGUN_S = 60.0  # a folder as new as this may belong to a program that has not locked it yet
_unpacked: list[tuple[TemporaryDirectory[str], str, int | None]] = []  # projects that were opened: folder, file, lock


def without_folders(text: str) -> str:
    """A sentence that names a project where it named its temporary folder."""
    for folder, model, _ in _unpacked:
        text = text.replace(f"{folder.name}/.model/", "").replace(folder.name, model)
    return text


def close_projects() -> None:
    """Remove the folders of all projects that were opened; else that is done when the program ends."""
    while _unpacked:
        folder, _, lock = _unpacked.pop()
        if lock is not None:
            os.close(lock)
        folder.cleanup()


@dataclass(frozen=True)
class Project:
    """A model and everything that decides its print; files lie in the project's folder once it is read.

    model: None for a demo, which its name finds; own_names: of profiles that are files, by their kind, as a person knows
    them; rotation: rows of how the model is turned after it is read; plan: None where the model is neither cut nor marked;
    parts: 0 where nobody has cut it; locked: the parts, counted from the second, whose planes are locked; stops: where the
    print waits for a person; marks_in_plan: the plan has the marks that the model's own file has, too; figures: of the print,
    for people and other programs; plate: of the model where that is another slicer's project.
    """

    name: str
    model: Path | None
    given: Given
    rotation: tuple[Vector, ...] = STANDING
    plan: Path | None = None
    parts: int = 0
    locked: tuple[int, ...] = ()
    stops: tuple[Stop, ...] = ()
    copies: int = 1
    own_names: dict[str, str] = field(default_factory=dict)
    figures: dict[str, float] = field(default_factory=dict)
    written_s: float = 0.0
    plate: int | None = None
    marks_in_plan: bool = False

    def applied(self, asked: ModelRequest, file: Path, copies: int | None) -> ModelRequest:
        """A request for the model inside: the project decides what the command line leaves open.

        file: the project; copies: as the user has given it, None for as many as the project has.
        """
        own_plan = self.plan if not asked.cuts.plans and asked.cuts.planes is None else None
        return replace(
            asked,
            model=self.argument,
            project=file,
            cuts=asked.cuts if own_plan is None else replace(asked.cuts, plans=(own_plan,)),
            own_marks=own_plan is None or not self.marks_in_plan,
            stops=asked.stops or self.stops,
            copies=self.copies if copies is None else copies,
            plate=self.plate if asked.plate is None else asked.plate,
        )

    @property
    def argument(self) -> str:
        """What a command line says for MODEL."""
        return self.name if self.model is None else str(self.model)


def write_folder(folder: Path, project: Project, plan: PlanFile | None) -> None:
    """Write a project's folder. Older models in it go; profiles and meshes stay, for a step that is undone may name them.

    Raises OSError and ProfileError; the record is written last, so that it names only what is there.
    """
    profiles = {kind: name for kind in KINDS if (name := _profile_file(folder, kind, getattr(project.given, kind)))}
    model = "" if project.model is None else _copied(project.model, folder, "model")
    if plan is not None:
        write_whole(folder / PLAN, plan_text(with_meshes(plan, folder), folder).encode())
    record = {
        "version": VERSION,
        "program": PROGRAM,
        "name": project.name,
        "model": model,
        "given": {**asdict(project.given), **profiles},
        "own_profiles": {kind: _bare_name(Path(getattr(project.given, kind))) for kind in profiles},
        "rotation": project.rotation,
        "plan": plan is not None,
        "parts": project.parts,
        "locked": project.locked,
        "pauses": [stop.option.partition(" ")[2] for stop in project.stops if not stop.change],
        "changes": [stop.option.partition(" ")[2] for stop in project.stops if stop.change],
        "copies": project.copies,
        "plate": project.plate,
        "marks_in_plan": project.marks_in_plan,
        "figures": project.figures,
    }
    write_whole(folder / RECORD, json.dumps(record).encode())
    for file in folder.glob("model-*"):
        if file.name != model:
            file.unlink()
    if plan is None:
        (folder / PLAN).unlink(missing_ok=True)


def _profile_file(folder: Path, kind: str, name: str) -> str:
    """The name of a file with a profile of the user's own; "" for one that ships with the program."""
    if name in shipped(kind) and name not in own(kind):
        return ""
    text = profile_text(kind, name).encode()
    file = f"{kind}-{hashlib.sha256(text).hexdigest()[:12]}-{plain_name(Path(_bare_name(Path(name))).stem)}.toml"
    if not (folder / file).exists():
        write_whole(folder / file, text)
    return file


def with_meshes(plan: PlanFile, folder: Path) -> PlanFile:
    """The plan with copies of the meshes of its marks and modifiers in a folder."""

    def copied(volume: Any) -> Any:
        if not isinstance(volume, MeshVolume):
            return volume
        return replace(volume, file=(folder / _copied(volume.file, folder, "modifier")).absolute())

    marks = {kind: tuple(map(copied, getattr(plan.zones, kind))) for kind in ZONE_KINDS}
    modifiers = tuple(replace(own, volume=copied(own.volume)) for own in plan.zones.modifiers)
    return replace(plan, zones=replace(plan.zones, modifiers=modifiers, **marks))


def _check_alone(model: Path | None) -> None:
    """Raise PlanError for a glTF file that refers to others, which a project would lack."""
    if model is None or model.suffix.lower() != ".gltf":
        return
    document = json.loads(model.read_text(encoding="utf-8"))
    for buffer in document.get("buffers", []):
        if not (file := buffer.get("uri", "data:")).startswith("data:"):
            raise PlanError(f"{model}: refers to the file {file}, and a project holds one model file: save it as .glb first")


def _bare_name(file: Path) -> str:
    """The name of a file as it was before it became one of a project."""
    return ADDED.sub("", file.name)


def _copied(file: Path, folder: Path, role: str) -> str:
    """The name in a folder of a copy of a file, which is made where it is not there yet."""
    with file.open("rb") as source:
        digest = hashlib.file_digest(source, "sha256").hexdigest()
    name = f"{role}-{digest[:12]}-{plain_name(_bare_name(file))}"
    if not (folder / name).exists():
        with file.open("rb") as source, whole_file(folder / name) as copy:
            shutil.copyfileobj(source, copy)
    return name


def read_folder(folder: Path) -> Project:
    """The project in a folder. Raises PlanError with a sentence where it cannot be read, or not by this version."""
    try:
        return _read(folder, f"this work was kept by a newer tiltprint, which can open it; it stays in {folder}")
    except OSError as error:
        raise PlanError(f"the work in {folder} cannot be read: {reason(error)}") from None
    except BAD_RECORD:
        raise PlanError(f"what is kept in {folder} is no work of a workbench, or damaged") from None


def _read(folder: Path, newer: str) -> Project:
    """The project; newer: the sentence for one of a newer version."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    if not isinstance(record["version"], int) or record["version"] < 1:
        raise ValueError(f"version {record['version']!r}")
    if record["version"] > VERSION:
        raise PlanError(newer)
    return _project_of(folder, record)


def _check_name(name: str) -> None:
    """Raise ValueError for a model's name that no file can have."""
    control = any(ord(letter) < 32 for letter in name)
    if Path(name).name != name or name in ("", "..") or control or len(name.encode()) > LONGEST_NAME:
        raise ValueError(f"name {name!r}")


def _check_inside(folder: Path, project: Project) -> None:
    """Raise ValueError where a project names files that are not in it."""
    if project.model is not None and not project.model.is_file():
        raise ValueError(f"model {project.model.name!r}")
    for kind in KINDS:
        name = getattr(project.given, kind)
        if kind not in project.own_names:
            outside = is_file_name(name)
        else:
            outside = is_file_name(str(read_toml(Path(name).read_text(encoding="utf-8")).get(PARENT, shipped(kind)[0])))
        if outside:
            raise ValueError(f"{kind} {name!r}")
    plan = {} if project.plan is None else read_toml(project.plan.read_text(encoding="utf-8"))
    for table in (table for key in (*ZONE_KINDS, "modifier") for table in plan.get(key, [])):
        if (mesh := table.get("mesh")) is not None and Path(str(mesh)).name != mesh:
            raise ValueError(f"mesh {mesh!r}")


def _project_of(folder: Path, record: dict[str, Any]) -> Project:
    given, name = record["given"], str(record["name"])
    _check_name(name)
    rows = np.array(record["rotation"], dtype=np.float64)
    if rows.shape != (3, 3) or not np.allclose(rows @ rows.T, np.eye(3), atol=1e-6):
        raise ValueError(f"rotation {record['rotation']!r}")
    if not 1 <= int(record["copies"]) <= MOST_COPIES:
        raise ValueError(f"copies {record['copies']!r}")
    if not all(isinstance(given[kind], str) for kind in KINDS):
        raise ValueError(f"profiles {given!r}")
    own_names = {str(kind): Path(name).name for kind, name in record["own_profiles"].items()}
    files = {kind: str(folder / Path(given[kind]).name) for kind in own_names}
    return Project(
        name=name,
        model=folder / Path(record["model"]).name if record["model"] else None,
        given=Given(**{**given, **files, "settings": tuple(map(str, given["settings"]))}),
        rotation=tuple((float(x), float(y), float(z)) for x, y, z in record["rotation"]),
        plan=folder / PLAN if record["plan"] else None,
        parts=int(record["parts"]),
        locked=tuple(map(int, record["locked"])),
        stops=parse_stops(record["pauses"], record["changes"]),
        copies=int(record["copies"]),
        marks_in_plan=bool(record.get("marks_in_plan", True)),
        plate=None if record.get("plate") is None else int(record["plate"]),
        own_names=own_names,
        figures={str(key): float(value) for key, value in record.get("figures", {}).items()},
        written_s=(folder / RECORD).stat().st_mtime,
    )


def figures_of(row: FrontRow | None) -> dict[str, float]:
    """The figures of a decomposition, as far as they are known."""
    names = ("time_s", "filament_mm", "support_area_mm2", "seam_mm", "cost_mm2")
    return {name: value for name in names if (value := getattr(row, name, None)) is not None}


def project_bytes(project: Project, plan: PlanFile, mesh: Mesh, picture: bytes) -> bytes:
    """The content of a project file: mesh is the model as it lies, picture a PNG.

    Raises OSError, and PlanError for what could not be opened again.
    """
    _check_alone(project.model)
    try:
        _check_name(project.name)
    except ValueError:
        raise PlanError(f"{project.name!r}: a project cannot keep a model of this name: rename its file") from None
    content = io.BytesIO()
    with TemporaryDirectory(prefix=PREFIX) as name:
        folder = Path(name)
        write_folder(folder, project, plan)
        model = model_xml([(mesh, project.name)], {"Title": project.name, "Application": PROGRAM})
        digest = hashlib.sha256(model.encode()).hexdigest().encode()
        own_files = [(INSIDE + path.name, path.read_bytes()) for path in sorted(folder.iterdir())]
        if len(own_files) > MOST_FILES or sum(len(file) for _, file in own_files) + len(model) > LARGEST_BYTES:
            raise PlanError(f"{project.name}: a project holds at most {MOST_FILES} files and {LARGEST_BYTES} bytes")
        write_package(content, model, [(THUMBNAIL, picture), (INSIDE + MESH_DIGEST, digest), *own_files])
    return content.getvalue()


def is_project(path: Path) -> bool:
    """Whether a file is a project that `project_bytes` made, or one that was damaged since."""
    if path.suffix.lower() != SUFFIX or not path.is_file():
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return INSIDE + RECORD in archive.namelist()
    except DAMAGED:
        return False


def open_project(model: str) -> Project | None:
    """A project file, unpacked for as long as the program runs; None for any other MODEL. Raises PlanError."""
    if model.startswith(DEMO) or not is_project(Path(model)):
        return None
    _tidy()
    folder = TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True)
    lock = lock_folder(Path(folder.name))  # for as long as the program runs
    _unpacked.append((folder, model, lock))
    project = unpack(Path(model), Path(folder.name))
    if project.model is None:
        return project
    named = Path(folder.name) / ".model" / Path(project.name).name  # messages and G-code say the name that the model had
    named.parent.mkdir()
    return replace(project, model=project.model.rename(named))


def _tidy() -> None:
    """Remove the folders of programs that were killed while they had a project open."""
    for folder in Path(gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if time() - folder.stat().st_mtime > BEGUN_S and (lock := lock_folder(folder, surely=True)) is not None:
                remove_locked(folder, lock)


def unpack(path: Path, folder: Path) -> Project:
    """A project file, unpacked into an empty folder. Raises PlanError for one that is damaged or was changed."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if entry.filename.startswith(INSIDE)]
            read = [*entries, archive.getinfo(MODEL_PART)]
            if len(entries) > MOST_FILES or sum(entry.file_size for entry in read) > LARGEST_BYTES:
                raise PlanError(f"{path}: unpacks to more than {MOST_FILES} files or {LARGEST_BYTES} bytes")
            for entry in entries:
                if not FILE_NAME.fullmatch(entry.filename.removeprefix(INSIDE)):
                    raise ValueError(f"file name {entry.filename!r}")
                with archive.open(entry) as source, (folder / Path(entry.filename).name).open("xb") as copy:
                    shutil.copyfileobj(source, copy)
            changed = hashlib.sha256(archive.read(MODEL_PART)).hexdigest() != archive.read(INSIDE + MESH_DIGEST).decode()
        project = _read(folder, f"{path}: this project was saved by a newer tiltprint, which can open it")
        _check_inside(folder, project)
    except PlanError:
        raise
    except DAMAGED as error:
        raise PlanError(f"{path}: this project is damaged ({error})".replace(str(folder), str(path))) from None
    if changed:
        raise PlanError(
            f"{path}: another program has changed the model in this project, which its plan was made for: save the model"
            " from there as STL, and decompose that"
        )
    return project
