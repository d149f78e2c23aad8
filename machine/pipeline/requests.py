"""Requests: the user's orders to commands, as values made by the command line."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from profiles.errors import PlanError
from profiles.messages import phrase

if TYPE_CHECKING:
    from machine.planning.stops import Stop
    from profiles.profile import Profile

STDOUT = Path("-")  # standard output as a file
PLACING = ("process.scale", "process.rotate_deg", "process.place_mm")  # position and orientation of a model
GCODE_SUFFIXES = {".gcode", ".gco", ".g", ".nc", ".ngc"}
SIMULATED = "sim"  # the port of the simulated printer
BAUD = 115200
UPLOAD_MIB = 256  # the largest upload from a page: five million facets of a binary STL
MOST_COPIES = 1000  # copies of a model, and models on a plate
FORCE_GOES_ON = phrase("force", "--force continues")  # ending of a forcible error's message


def check_copies(count: int, said: str) -> None:
    """Raise PlanError for an invalid number of copies. said: its name in messages."""
    if not 1 <= count <= MOST_COPIES:
        raise PlanError(f"{said} is {count}: 1 to {MOST_COPIES} is allowed")


@dataclass(frozen=True)
class Outputs:
    """Files to write; None: not requested. For gcode and json the path - is standard output.

    folder: for parts, decomposition and plan; sheet: picture of the print order; front: picture of every number of parts; record:
    of the search; plan: for later runs without a search; layer: the one in the svg, as PART:LAYER.
    """

    folder: Path | None = None
    gcode: Path | None = None
    json: Path | None = None
    html: Path | None = None
    png: Path | None = None
    sheet: Path | None = None
    front: Path | None = None
    svg: Path | None = None
    layer: str | None = None
    record: Path | None = None
    plan: Path | None = None

    @property
    def files(self) -> dict[str, Path | None]:
        """The files by the names of their fields."""
        return {name: file for name, file in vars(self).items() if name not in ("folder", "layer")}


@dataclass(frozen=True)
class ModelRequest:
    """A model or a G-code file and what to make of it.

    chosen_sections: sections of the profile named by the user, which take precedence over a G-code file's own. orient: search for
    the cheapest orientation; None: if nothing else gives one. plans: files whose planes are cut instead of a search, at most one
    per model; parts: the most parts; planes: file of user-defined planes that the search starts from. compare: with the same
    model in one part. force: continue although the dry run found errors. profile_names, settings: the user's machine, material
    and process, names or files, and KEY=VALUE over them. project: the project file of the model; own_marks: the boxes marked in
    the model's file count beside those of the plan, which otherwise includes them. stops: where the print waits for the user.
    copies: of each model on the plate; beside: the other models there. plate: of each model's slicer file; None: the first that
    is not empty. verbose: also report the cuts that the search has tried.
    """

    model: str
    profile: "Profile"
    chosen_sections: frozenset[str] = frozenset()
    ranker: str = "classic"
    orient: bool | None = None
    outputs: Outputs = Outputs()
    compare: bool = False
    force: bool = False
    plans: tuple[Path, ...] = ()
    parts: int | None = None
    planes: Path | None = None
    profile_names: tuple[str | None, ...] = ()
    settings: tuple[str, ...] = ()
    project: Path | None = None
    own_marks: bool = True
    stops: "tuple[Stop, ...]" = ()
    copies: int = 1
    beside: tuple[str, ...] = ()
    plate: int | None = None
    verbose: bool = False

    @property
    def name(self) -> str:
        """Name of the (first) model for files and messages: the file's name without its folder."""
        return self.model if self.model.startswith("demo:") else Path(self.model).name

    @property
    def models(self) -> tuple[str, ...]:
        """The models of the plate, each once."""
        return tuple(dict.fromkeys((self.model, *self.beside)))

    @property
    def plan(self) -> Path | None:
        """The plan of a single model, or None."""
        return self.plans[0] if self.plans else None

    @property
    def is_gcode(self) -> bool:
        """Whether the file holds G-code, by its name."""
        return Path(self.model).suffix.lower() in GCODE_SUFFIXES


@dataclass(frozen=True)
class Given:
    """Sources of a profile: names of machine, material and process, and KEY=VALUE settings over them."""

    machine: str = "generic_ac"
    material: str = "pla"
    process: str = "standard"
    settings: tuple[str, ...] = ()

    def replaced(self, names: Sequence[str | None], settings: Sequence[str]) -> "Given":
        """Sources with other profiles and further settings.

        A replaced profile takes its settings with it, except position and orientation.
        """
        kinds = ("machine", "material", "process")
        changed = {kind: name for kind, name in zip(kinds, names, strict=True) if name is not None}
        stay = (text for text in self.settings if _kind(text) not in changed or text.partition("=")[0].strip() in PLACING)
        return Given(**{kind: getattr(self, kind) for kind in kinds} | changed, settings=(*stay, *settings))


def _kind(setting: str) -> str:
    """The kind of profile to which a KEY=VALUE setting belongs; search settings belong to the process."""
    section = setting.partition(".")[0].strip()
    return "process" if section == "search" else section
