"""Project: a model with everything that decides its print: plan, marks, profiles, placement, pauses, copies.

A project's folder holds `work.json`, with the settings and the names of the other files: the original model file, the plan,
meshes of modifiers, and profiles that are not shipped. The workbench stores its work in such folders. A project file is a 3MF of
the oriented model, which any slicer opens, with a picture and the folder's files under Metadata/tiltprint.
"""

import hashlib
import io
import json
import os
import re
import shutil
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from time import time
from typing import Any

import numpy as np

from machine.pipeline.output import plain_name
from machine.pipeline.profile_file import profile_text
from machine.pipeline.project_record import (
    RECORD,
    VERSION,
    VERSION_OF_ONE_MODEL,
    GivenRecord,
    NewerError,
    Record,
    checked_record,
    is_file_name_anywhere,
    read_record,
)
from machine.pipeline.requests import Given, ModelRequest
from machine.planning.stops import Stop
from mdp.decomposition import FrontRow
from mdp.mesh import Mesh
from mdp.model_file import DEMO
from mdp.save import MODEL_PART, model_xml, write_package
from mdp.search.plan_file import ZONE_KINDS, PlanFile
from mdp.zone import MeshVolume
from profiles.errors import PlanError, first_line, reason
from profiles.files import DAMAGED_ZIP, lock_folder, remove_locked, whole_file, write_whole
from profiles.frozen import Vector
from profiles.messages import option
from profiles.places import KINDS, PARENT, is_file_name, own, shipped
from profiles.toml_text import read_toml

STANDING: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))  # orientation of the file
PLAN = "plan.toml"
INSIDE, THUMBNAIL = "Metadata/tiltprint/", "Metadata/thumbnail.png"
PICTURE_PX = (256, 256)
MESH_DIGEST = "mesh.sha256"  # digest of the 3MF's model part, to detect changes by other programs
PROGRAM = f"tiltprint {version('tiltprint')}"
SUFFIX = ".3mf"
FILE_NAME = re.compile(r"(?!\.)[\w.+-]{1,240}")  # name of a file in a project: without a folder, valid on any disk
ADDED = re.compile(rf"^(model|modifier|{'|'.join(KINDS)})-([0-9a-f]{{12}})-")  # prefix of the names of a project's files
MOST_FILES, LARGEST_BYTES = 100, 2**30  # limits for a project: a zip of a few kB can unpack to more than any disk
DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, OSError)  # errors of a damaged zip archive
PREFIX = "tiltprint-project-"  # prefix of temporary folders
BEGUN_S = 60.0  # a newer folder may belong to a program that has not locked it yet
_unpacked: list[tuple[TemporaryDirectory[str], str, int | None]] = []  # open projects: folder, file, lock


def without_folders(text: str) -> str:
    """A message that names a project instead of its temporary folder."""
    for folder, model, _ in _unpacked:
        text = text.replace(f"{folder.name}/.model/", "").replace(folder.name, model)
    return text


def close_projects() -> None:
    """Remove the folders of all open projects, which otherwise happens at the program's exit."""
    while _unpacked:
        folder, _, lock = _unpacked.pop()
        if lock is not None:
            os.close(lock)
        folder.cleanup()


@dataclass(frozen=True)
class Project:
    """A model and everything that decides its print, and the other models on its plate; once read, its files are in the project's
    folder.

    model: None for a demo, found by its name; own_names: the user's names of profiles that are files, by kind; rotation: rows of
    the model's rotation after reading; plan: None if the model is neither cut nor marked; parts: 0 before a decomposition;
    locked: the parts, counted from the second, whose planes are locked; stops: where the print waits for the user; marks_in_plan:
    the plan includes the boxes of the model's file; figures: of the print, for users and other programs; plate: of the model in a
    slicer file; recommended: number of parts that the search prefers, 0: there was no search; beside: the other models on the
    plate, with the same profiles; worked_on: the one that the user turns and cuts, 0: this one.
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
    recommended: int = 0
    beside: "tuple[Project, ...]" = ()
    worked_on: int = 0

    def applied(self, request: ModelRequest, file: Path, copies: int | None) -> ModelRequest:
        """A request for the project's model: the project provides what the command line leaves open.

        file: the project; copies: the user's number, of the first model alone, None: the plate is the project's. Raises PlanError
        for conflicting options.
        """
        if self.beside and copies is not None and copies > 1:
            raise PlanError(f"{option('copies', copies)}: the project {file} says how many of each model stand on its plate")
        self.check_plate(request.plate, file)
        others = self.beside if copies is None else ()
        own_plans = self._plans_left(request, others)
        if self.plan in own_plans:
            self._check_plan_goes_with(request, file)
        return replace(
            request,
            model=self.argument,
            project=file,
            plans=(*request.plans, *own_plans),
            own_marks=self.plan not in own_plans or not self.marks_in_plan,
            stops=request.stops or self.stops,
            copies=self.copies if copies is None and not others else copies or 1,
            beside=self._beside() if others else (),
            plate=self.plate,
        )

    def _plans_left(self, request: ModelRequest, others: "Sequence[Project]") -> tuple[Path, ...]:
        """The plans of the project's models that the user's options leave in use."""
        if request.planes is not None or (request.plans and not others):
            return ()
        from mdp.search.plan_reading import read_plan

        replaced = {read_plan(file).model for file in request.plans}
        return tuple(each.plan for each in (self, *others) if each.plan is not None and each.name not in replaced)

    def check_plate(self, plate: int | None, file: Path) -> None:
        """Raise PlanError when another plate is requested: the project's parts belong to one."""
        if plate is not None:
            raise PlanError(f"{option('plate', plate)}: {file} is a project of tiltprint, whose plan is of one plate")

    def _check_plan_goes_with(self, request: ModelRequest, file: Path) -> None:
        if request.orient or (request.orient is False and self.rotation != STANDING):
            laid = option("orient") if request.orient else option("as-is")
            raise PlanError(f"{laid}: the project {file} says how its model lies; decompose the model itself to change that")
        if (record := request.outputs.record) is not None:
            raise PlanError(
                f"{option('record', record)}: the project {file} has its parts, so nothing is searched that could be recorded"
            )

    @property
    def names(self) -> list[str]:
        """The names of all models on the plate."""
        return [each.name for each in (self, *self.beside)]

    @property
    def files(self) -> list[Path]:
        """The files of all models on the plate except demos."""
        return [each.model for each in (self, *self.beside) if each.model is not None]

    @property
    def argument(self) -> str:
        """MODEL on a command line."""
        return self.name if self.model is None else str(self.model)

    def _beside(self) -> tuple[str, ...]:
        """The models beside the first copy of the first one, on a command line."""
        others = (other.copies * [other.argument] for other in self.beside)
        return tuple(chain((self.copies - 1) * [self.argument], *others))


def write_folder(folder: Path, project: Project, plans: Sequence[PlanFile | None]) -> None:
    """Write a project's folder. plans: of each model on the plate. Older models and plans in it are deleted; profiles and meshes
    stay, for an undone step may name them. Raises OSError, ProfileError and PlanError; the record is written last, so that it
    only names existing files."""
    profiles = {kind: name for kind in KINDS if (name := _profile_file(folder, kind, getattr(project.given, kind)))}
    models = {file: _copied(file, folder, "model") for file in project.files}
    plan_files = {plan_file(number): plan for number, plan in enumerate(plans) if plan is not None}
    for name, plan in plan_files.items():
        from mdp.search.plan_writing import plan_text  # loads tomlkit, which only projects need

        write_whole(folder / name, plan_text(with_meshes(plan, folder), folder).encode())
    first, *others = [
        {
            "name": each.name,
            "model": "" if each.model is None else models[each.model],
            "rotation": [list(row) for row in each.rotation],
            "plan": plan is not None,
            "parts": each.parts,
            "locked": list(each.locked),
            "copies": each.copies,
            "recommended": each.recommended,
        }
        for each, plan in zip((project, *project.beside), plans, strict=True)
    ]
    given = {**asdict(project.given), **profiles, "settings": list(project.given.settings)}
    record = checked_record(
        version=VERSION if project.beside else VERSION_OF_ONE_MODEL,
        program=PROGRAM,
        **first,
        given=GivenRecord(**given),
        own_profiles={kind: _bare_name(Path(getattr(project.given, kind))) for kind in profiles},
        pauses=[stop.at for stop in project.stops if not stop.change],
        changes=[stop.at for stop in project.stops if stop.change],
        beside=others,
        worked_on=project.worked_on,
        plate=project.plate,
        marks_in_plan=project.marks_in_plan,
        figures=project.figures,
    )
    write_whole(folder / RECORD, record.model_dump_json().encode())
    for file in (*folder.glob("model-*"), *folder.glob("plan*.toml")):
        if file.name not in (*models.values(), *plan_files):
            file.unlink()


def plan_file(number: int) -> str:
    """Name of the file with the plan of a model on the plate, counted from 0."""
    return PLAN if number == 0 else f"plan-{number + 1}.toml"


def _profile_file(folder: Path, kind: str, name: str) -> str:
    """Name of the file with a user's profile, which is written if missing; "" for a shipped one."""
    if name in shipped(kind) and name not in own(kind):
        return ""
    text = profile_text(kind, name).encode()
    file = f"{kind}-{hashlib.sha256(text).hexdigest()[:12]}-{plain_name(Path(_bare_name(Path(name))).stem)}.toml"
    if not (folder / file).exists():
        write_whole(folder / file, text)
    return file


def with_meshes(plan: PlanFile, folder: Path) -> PlanFile:
    """The plan with the meshes of its marks and modifiers copied to a folder."""
    return _with_mesh_files(plan, lambda file: (folder / _copied(file, folder, "modifier")).absolute())


def with_meshes_beside(plan: PlanFile) -> tuple[PlanFile, dict[str, Path]]:
    """The plan with meshes beside it, named as `with_meshes` names them, and the original files by these names."""
    files = dict[str, Path]()

    def beside(file: Path) -> Path:
        files[_name_inside(file, "modifier")] = file
        return Path(_name_inside(file, "modifier"))

    return _with_mesh_files(plan, beside), files


def _with_mesh_files(plan: PlanFile, file_of: Callable[[Path], Path]) -> PlanFile:
    def named(volume: Any) -> Any:
        return replace(volume, file=file_of(volume.file)) if isinstance(volume, MeshVolume) else volume

    marks = {kind: tuple(map(named, getattr(plan.zones, kind))) for kind in ZONE_KINDS}
    modifiers = tuple(replace(modifier, volume=named(modifier.volume)) for modifier in plan.zones.modifiers)
    return replace(plan, zones=replace(plan.zones, modifiers=modifiers, **marks))


def _check_alone(model: Path) -> None:
    """Raise PlanError for a glTF file that refers to others, which a project would lack."""
    if model.suffix.lower() != ".gltf":
        return
    document = json.loads(model.read_text(encoding="utf-8"))
    for buffer in document.get("buffers", []):
        if not (file := buffer.get("uri", "data:")).startswith("data:"):
            raise PlanError(f"{model}: refers to the file {file}, and a project holds one model file: save it as .glb first")


def _digest(file: Path) -> str:
    """Digest of a file's content for its name in a project."""
    with file.open("rb") as source:
        return hashlib.file_digest(source, "sha256").hexdigest()[:12]


def _name_inside(file: Path, role: str) -> str:
    return f"{role}-{_digest(file)}-{plain_name(_bare_name(file))}"


def _bare_name(file: Path) -> str:
    """A file's name without the prefix of a project."""
    return ADDED.sub("", file.name)


def _copied(file: Path, folder: Path, role: str) -> str:
    """Copy a file into a folder, if it is not there yet; returns its name there."""
    name = _name_inside(file, role)
    if not (folder / name).exists():
        with file.open("rb") as source, whole_file(folder / name) as copy:
            shutil.copyfileobj(source, copy)
    return name


def read_folder(folder: Path) -> Project:
    """The project in a folder. Raises PlanError if it is unreadable or from a newer version."""
    try:
        return _project_of(folder, read_record(folder))
    except NewerError:
        raise PlanError(f"this work was kept by a newer tiltprint, which can open it; it stays in {folder}") from None
    except PlanError as error:
        raise PlanError(f"the work in {folder} is not of a workbench, or damaged: {error}") from None
    except OSError as error:
        raise PlanError(f"the work in {folder} cannot be read: {reason(error)}") from None


def _project_of(folder: Path, record: Record) -> Project:
    given, own_names = record.given, {str(kind): Path(name).name for kind, name in record.own_profiles.items()}
    files = {kind: str(folder / Path(getattr(given, kind)).name) for kind in own_names}
    first, *others = [
        Project(
            name=each.name,
            model=folder / Path(each.model).name if each.model else None,
            given=Given(**{**given.model_dump(), **files, "settings": tuple(given.settings)}),
            rotation=tuple((x, y, z) for x, y, z in each.rotation),
            plan=folder / plan_file(number) if each.plan else None,
            parts=each.parts,
            locked=tuple(each.locked),
            copies=each.copies,
            marks_in_plan=record.marks_in_plan,
            recommended=each.recommended,
        )
        for number, each in enumerate((record, *record.beside))
    ]
    return replace(
        first,
        stops=record.stops,
        beside=tuple(others),
        worked_on=record.worked_on,
        plate=record.plate,
        own_names=own_names,
        figures=record.figures,
        written_s=(folder / RECORD).stat().st_mtime,
    )


def _check_inside(folder: Path, project: Project) -> None:
    """Raise PlanError when an unpacked project's files are not those it names, or have changed."""
    models = (project, *project.beside)
    for each in models:
        if each.model is None and not each.name.startswith(DEMO):
            raise PlanError(f"{RECORD}: model is missing")
        if each.model is not None and not each.model.name.startswith("model-"):
            raise PlanError(f"{RECORD}: model is {each.model.name!r}: a file model-... of the project is expected")
    if project.plan is None:
        raise PlanError(f"{RECORD}: plan is false: a project has one")
    plans = [each.plan for each in models if each.plan is not None]
    for file in (*project.files, *(Path(getattr(project.given, kind)) for kind in project.own_names), *plans):
        if not file.is_file():
            raise PlanError(f"its file {file.name or RECORD} is missing")
    for file in folder.iterdir():
        if (digest := ADDED.match(file.name)) is not None and digest[2] != _digest(file):
            raise PlanError(f"its file {file.name} is not as it was saved")
    for kind in KINDS:
        name = getattr(project.given, kind)
        if kind in project.own_names:
            name = str(_toml(Path(name)).get(PARENT, shipped(kind)[0]))
        if is_file_name(name):
            raise PlanError(f"{kind} is {name!r}: a profile that ships with the program, or a file of the project, is expected")
    for each in models:
        if each.plan is not None:
            _check_plan(each, each.plan)


def _check_plan(project: Project, file: Path) -> None:
    """Raise PlanError if the plan of one of a project's models cannot be read, or does not agree with the record."""
    text = _toml(file)
    lists = (text[key] for key in (*ZONE_KINDS, "modifier") if isinstance(text.get(key), list))
    for mesh in (table["mesh"] for tables in lists for table in tables if isinstance(table, dict) and "mesh" in table):
        if Path(str(mesh)).name != mesh:
            raise PlanError(f"{file.name}: mesh is {mesh!r}: a file of the project is expected")
    try:
        from mdp.search.plan_reading import read_plan  # takes 30 ms to load; only projects need it

        plan = read_plan(file)
    except PlanError as error:
        raise PlanError(f"{error}".replace(f"{file.parent}{os.sep}", "")) from None
    if max(project.parts, 1) != len(plan.parts) + 1:
        raise PlanError(f"{RECORD}: parts is {project.parts}: {file.name} has {len(plan.parts) + 1}")
    if not np.allclose(plan.orientation or STANDING, project.rotation, atol=1e-9):
        raise PlanError(f"{RECORD}: rotation is {project.rotation}, which is not the orientation of {file.name}")


def _toml(file: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises PlanError."""
    try:
        return read_toml(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise PlanError(f"its file {file.name} is not TOML: {error}") from None


def figures_of(row: FrontRow | None) -> dict[str, float]:
    """The known figures of a decomposition."""
    names = ("time_s", "filament_mm", "support_area_mm2", "seam_mm", "cost_mm2")
    return {name: value for name in names if (value := getattr(row, name, None)) is not None}


def project_bytes(project: Project, plans: Sequence[PlanFile], mesh: Mesh, picture: bytes) -> bytes:
    """Content of a project file. plans: of each model on the plate; mesh: the first one in its orientation; picture: a PNG.

    Raises OSError, and PlanError for a project that could not be opened again.
    """
    for file in project.files:
        _check_alone(file)
    for name in project.names:
        if not is_file_name_anywhere(name):
            raise PlanError(f"{name!r}: a project cannot keep a model of this name: rename its file")
    content = io.BytesIO()
    with TemporaryDirectory(prefix="tiltprint-save-") as name:
        folder = Path(name)
        write_folder(folder, project, plans)
        model = model_xml([(mesh, project.name)], {"Title": project.name, "Application": PROGRAM})
        digest = hashlib.sha256(model.encode()).hexdigest().encode()
        own_files = [(INSIDE + path.name, path.read_bytes()) for path in sorted(folder.iterdir())]
        if len(own_files) > MOST_FILES or sum(len(file) for _, file in own_files) + len(model) > LARGEST_BYTES:
            raise PlanError(f"{project.name}: a project holds at most {MOST_FILES} files and {LARGEST_BYTES} bytes")
        write_package(content, model, [(THUMBNAIL, picture), (INSIDE + MESH_DIGEST, digest), *own_files])
    return content.getvalue()


def is_project(path: Path) -> bool:
    """Whether a file is a project of `project_bytes`, perhaps damaged."""
    if path.suffix.lower() != SUFFIX or not path.is_file():
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.startswith(INSIDE) for name in archive.namelist())
    except DAMAGED:
        return False


def open_project(model: str) -> Project | None:
    """A project file, unpacked until the program exits; None for any other MODEL. Raises PlanError."""
    if model.startswith(DEMO) or not is_project(Path(model)):
        return None
    _tidy()
    folder = TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True)
    lock = lock_folder(Path(folder.name))  # until the program exits
    _unpacked.append((folder, model, lock))
    project = unpack(Path(model), Path(folder.name))
    named = Path(folder.name) / ".model"  # messages and G-code show the models' original names
    named.mkdir()

    def renamed(name: str, file: Path | None) -> Path | None:
        return None if file is None else Path(shutil.copyfile(file, named / Path(name).name))

    beside = tuple(replace(other, model=renamed(other.name, other.model)) for other in project.beside)
    return replace(project, model=renamed(project.name, project.model), beside=beside)


def _tidy() -> None:
    """Remove the folders of programs that were killed with a project open."""
    for folder in Path(gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if time() - folder.stat().st_mtime > BEGUN_S and (lock := lock_folder(folder, surely=True)) is not None:
                remove_locked(folder, lock)


def unpack(path: Path, folder: Path) -> Project:
    """A project file, unpacked into an empty folder. Raises PlanError for one that is damaged or was changed."""
    try:
        with zipfile.ZipFile(path) as archive:
            changed = _extract(archive, folder)
        project = _project_of(folder, read_record(folder))
        _check_inside(folder, project)
    except NewerError:
        raise PlanError(f"{path}: this project was saved by a newer tiltprint, which can open it") from None
    except PlanError as error:
        raise PlanError(f"{path}: this project is damaged: {error}") from None
    except DAMAGED as error:
        raise PlanError(f"{path}: this project is damaged: it is not a complete zip archive ({first_line(error)})") from None
    if changed:
        raise PlanError(
            f"{path}: another program has changed the model in this project, which its plan was made for: save the model"
            " from there as STL, and decompose that"
        )
    return project


def _extract(archive: zipfile.ZipFile, folder: Path) -> bool:
    """Unpack a project's files; returns whether its model for other slicers was changed. Raises PlanError."""
    entries = [entry for entry in archive.infolist() if entry.filename.startswith(INSIDE)]
    names = {entry.filename for entry in archive.infolist()}
    for name in (MODEL_PART, INSIDE + MESH_DIGEST, INSIDE + RECORD):
        if name not in names:
            raise PlanError(f"{name} is missing")
    read = [*entries, archive.getinfo(MODEL_PART)]
    if len(entries) > MOST_FILES or sum(entry.file_size for entry in read) > LARGEST_BYTES:
        raise PlanError(f"it unpacks to more than {MOST_FILES} files or {LARGEST_BYTES} bytes")
    for entry in entries:
        if entry.is_dir():
            continue  # zip -r writes an entry for each folder
        name = entry.filename.removeprefix(INSIDE)
        if not FILE_NAME.fullmatch(name) or (folder / name).exists():
            raise PlanError(f"{entry.filename!r} is not the name of a project's file, or occurs twice")
        with archive.open(entry) as source, (folder / name).open("xb") as copy:
            shutil.copyfileobj(source, copy)
    digest = hashlib.sha256(archive.read(MODEL_PART)).hexdigest()
    return digest.encode() != archive.read(INSIDE + MESH_DIGEST)
