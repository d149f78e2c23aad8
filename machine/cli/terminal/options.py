"""Options shared by several commands: dataclasses whose fields are options, and the requests made from them."""

import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, asdict, dataclass, fields, is_dataclass, replace
from functools import wraps
from inspect import Parameter, Signature, signature
from math import isnan
from os.path import exists
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

import typer

from machine.pipeline.requests import MOST_COPIES, Given, ModelRequest
from profiles.errors import PlanError

if TYPE_CHECKING:
    from profiles.profile import Profile


def option(names: str, meaning: str, **further: Any) -> Any:
    """An option of the command line. names: flags and the placeholder of the value, such as `-o --out FILE`."""
    *flags, last = names.split(" ")
    if not last.startswith("-"):
        further["metavar"] = last
    else:
        flags.append(last)
    return typer.Option(*flags, help=meaning, **further)


def with_option_groups(command: Callable[..., int]) -> Callable[..., int]:
    """Expand each dataclass parameter of a command into one option per field, for typer.

    Dataclasses can be nested. A tuple of any length becomes a repeatable option, empty by default.
    """
    annotations = {name: parameter.annotation for name, parameter in signature(command).parameters.items()}
    parameters: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        parameters += _parameters(name, parameter.annotation, parameter.default)

    @wraps(command)
    def run(**given: Any) -> int:
        return command(**{name: _value(name, annotation, given) for name, annotation in annotations.items()})

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return run


def _is_group(annotation: Any) -> bool:
    return isinstance(annotation, type) and is_dataclass(annotation)


def _is_repeatable(annotation: Any) -> bool:
    values = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return get_origin(values) is tuple and get_args(values)[1:] == (...,)


def _parameters(name: str, annotation: Any, default: Any) -> list[Parameter]:
    if _is_group(annotation):
        return [each for field in fields(annotation) for each in _parameters(field.name, field.type, field.default)]
    if _is_repeatable(annotation):
        values, option = get_args(annotation)
        annotation, default = Annotated[list[get_args(values)[0]] | None, option], None  # type: ignore[misc]
    return [
        Parameter(name, Parameter.KEYWORD_ONLY, default=Parameter.empty if default is MISSING else default, annotation=annotation)
    ]


def _value(name: str, annotation: Any, given: Mapping[str, Any]) -> Any:
    """The value of a parameter: an instance for a dataclass, a tuple for a repeatable option."""
    if _is_group(annotation):
        return annotation(**{field.name: _value(field.name, field.type, given) for field in fields(annotation)})
    if isinstance(given[name], float) and isnan(given[name]):  # passes every bound
        asked = get_args(annotation)[1]  # typer stores the first name as the default
        raise typer.BadParameter(f"{(asked.default, *asked.param_decls)[-1]} is nan: it must be a number")
    return tuple(given[name] or ()) if _is_repeatable(annotation) else given[name]


def _names_of(kind: str) -> Callable[[str], list[str]]:
    """Shell completion for the names of shipped profiles and the user's own."""

    def complete(incomplete: str) -> list[str]:
        from profiles.places import known

        return [name for name in known(kind) if name.startswith(incomplete)]

    return complete


OF_FILE = "; default: that of the project or G-code file, else {}"


def profile_option(kind: str, otherwise: str = "") -> Any:
    words = f"{kind} profile{otherwise.format(getattr(Given, kind))}"
    return typer.Option(f"--{kind}", metavar="NAME|FILE", autocompletion=_names_of(kind), help=words)


Model = Annotated[
    str, typer.Argument(metavar="MODEL", help="STL, OBJ, OFF, PLY, 3MF, GLB, glTF, STEP, IGES or DAE file, or demo:NAME")
]
Models = Annotated[
    list[str],
    typer.Argument(
        metavar="MODEL",
        show_default=False,
        help="STL, OBJ, OFF, PLY, 3MF, GLB, glTF, STEP, IGES or DAE file, or demo:NAME; several share a plate, NAME:3 is three",
    ),
]
ModelsOrGcode = Annotated[
    list[str],
    typer.Argument(
        metavar="MODEL|FILE.gcode", show_default=False, help="model files or demo:NAME, as for export, or a G-code file"
    ),
]
MachineName = Annotated[str, profile_option("machine")]
MachineGiven = Annotated[str | None, profile_option("machine", OF_FILE)]
Settings = Annotated[
    tuple[str, ...], option("--set KEY=VALUE", "override a profile key, such as process.infill_density=20%; repeatable")
]
JsonFile = Annotated[Path | None, option("--json FILE", "write the result as JSON; - for standard output")]
HtmlFile = Annotated[Path | None, option("--html FILE", "page to write for a browser, see view")]
Force = Annotated[bool, option("--force", "continue although the dry run found errors")]
ForceAll = Annotated[bool, option("--force", "continue although dry run, printer, machine and program do not agree")]
LogFile = Annotated[
    Path | None, option("--log FILE", "log of what is sent and received; default: a new file in the state folder")
]
Baud = Annotated[int, option("--baud N", "bits per second")]
PortOrSim = Annotated[str, option("--port PORT|sim", "serial port; sim: the simulated printer")]
SimSpeed = Annotated[float, option("--sim-speed X", "X times real time; 0: as fast as possible")]
NoBrowser = Annotated[bool, option("--no-browser", "only print the address")]


@dataclass(frozen=True)
class SearchOptions:
    """Options that control the search for parts."""

    beam_width: Annotated[int | None, option("--beam-width B", "decompositions followed at a time")] = None
    search: Annotated[str | None, option("--search best|published", "published: the search of the 2020 paper")] = None
    time_limit: Annotated[float | None, option("--time-limit SECONDS", "stop then, and use the best parts so far")] = None
    ranker: Annotated[
        str,
        option(
            "--ranker classic|learned|FILE.onnx",
            "how to rank candidates: in the 2020 paper's order, by the shipped network, or by your own",
        ),
    ] = "classic"
    orient: Annotated[bool | None, option("--orient/--as-is", "choose the cheapest orientation, or keep that of the file")] = None
    parts: Annotated[int | None, option("--parts N", "cut into at most N parts; default: as many as pay off")] = None
    part: Annotated[
        tuple[str, ...], option("--part N:KEY=VALUE,...", "process keys of part N alone, such as 2:walls=4; repeatable")
    ] = ()

    verbose: Annotated[bool, option("-v --verbose", "also say how many cuts the search tried and why it rejected them")] = False

    @property
    def settings(self) -> list[str]:
        """The search options as settings of the profile."""
        values = {"beam_width": self.beam_width, "method": self.search, "time_limit_s": self.time_limit}
        return [f"search.{key}={value}" for key, value in values.items() if value is not None]


@dataclass(frozen=True)
class FileOptions(SearchOptions):
    """Options of a command for one model: how to cut it, and which plate and settings of a slicer file to use."""

    plate: Annotated[
        int | None, option("--plate N", "plate of a .3mf of Bambu Studio or OrcaSlicer; default: the first that is not empty")
    ] = None
    settings_of_file: Annotated[
        bool, option("--settings-of-file", "use the settings inside a .3mf of another slicer; see profiles import")
    ] = False


@dataclass(frozen=True)
class ProgramOptions(FileOptions):
    """Options between a model and its G-code; invalid for a G-code file."""

    plan: Annotated[
        tuple[Path, ...], option("--plan FILE", "cut by this plan of decompose, without a search; one for each model")
    ] = ()
    pause: Annotated[
        tuple[str, ...], option("--pause PART:LAYER", "wait for the user before this layer, or at a height: 1:8.4mm; repeatable")
    ] = ()
    filament_change: Annotated[
        tuple[str, ...],
        option("--filament-change PART:LAYER", "change the filament before this layer, or at a height; repeatable"),
    ] = ()
    copies: Annotated[int | None, option("--copies N", "copies of each model on the plate; default: 1")] = None


@dataclass(frozen=True)
class ProfileOptions:
    """The profiles by name, and settings over them; None means that of the project or G-code file, else the default."""

    machine: MachineGiven = None
    material: Annotated[str | None, profile_option("material", OF_FILE)] = None
    process: Annotated[str | None, profile_option("process", OF_FILE)] = None
    settings: Settings = ()

    @property
    def names(self) -> tuple[str | None, str | None, str | None]:
        """Names of machine, material and process as given."""
        return self.machine, self.material, self.process

    def given(self, search: SearchOptions | None = None) -> Given:
        """Names, with defaults in place of None, and all settings."""
        names = {
            kind: name for kind, name in zip(("machine", "material", "process"), self.names, strict=True) if name is not None
        }
        return Given(**names, settings=(*self.settings, *(search.settings if search else ())))

    def over(self, given: Given) -> "ProfileOptions":
        """These options on top of those that a project was made with."""
        new = given.replaced(self.names, self.settings)
        return ProfileOptions(new.machine, new.material, new.process, new.settings)

    @property
    def sections(self) -> frozenset[str]:
        """Sections of the profile that the user has set."""
        named = {kind for kind in ("machine", "material", "process") if getattr(self, kind) is not None}
        return frozenset(named | {setting.partition(".")[0] for setting in self.settings})

    def profile(self, search: SearchOptions | None = None) -> "Profile":
        """The profile, including the search options. Raises ProfileError."""
        from profiles.part_settings import parse_part_settings
        from profiles.profile import load, with_part_settings

        profile = load(**asdict(self.given(search)))
        return with_part_settings(profile, map(parse_part_settings, search.part if search else ()))


@dataclass(frozen=True)
class DefaultProfileOptions(ProfileOptions):
    """Profile options of a command that reads neither a model nor G-code."""

    machine: MachineName = Given.machine
    material: Annotated[str, profile_option("material")] = Given.material
    process: Annotated[str, profile_option("process")] = Given.process

    @property
    def names(self) -> tuple[str, str, str]:
        return self.machine, self.material, self.process


def named_models(models: list[str]) -> list[str]:
    """Expand MODEL:N to N times MODEL. Raises PlanError."""
    named: list[str] = []
    for text in models:
        counted = re.fullmatch(r"(.*[^:]):([-+\d.]*)", text)
        if counted is None or exists(text) or text == "demo:":
            named.append(text)
            continue
        name, count = counted.groups()
        if not re.fullmatch(r"[0-9]{1,9}", count) or not 1 <= int(count) <= MOST_COPIES:
            raise PlanError(f"{text}: the number of copies behind {name} must be a whole number from 1 to {MOST_COPIES}")
        named += int(count) * [name]
    return named


def check_model(model: str) -> None:
    """Refuse an invalid model file before the command is imported, which takes a second. Raises MeshError."""
    from mdp.model_file import check_file, locate

    check_file(locate(model))


def model_request(
    model: str, search: SearchOptions, given: ProfileOptions, copies: int | None = 1, **further: Any
) -> ModelRequest:
    """The request for a model; further: other fields of the request. A project provides what the options leave open.

    copies: None for one, or for the number in the project. Raises ProfileError, and PlanError for a damaged project.
    """
    from machine.pipeline.project import open_project

    file = search if isinstance(search, FileOptions) else FileOptions()
    project = open_project(model)
    if project is not None and file.settings_of_file:
        raise PlanError(f"--settings-of-file: {model} is a project of tiltprint, whose settings hold without it")
    if project is not None:
        given, profile = _over_project(given, project.given, search, model)
    else:
        given = given.over(_given_by(model, given)) if file.settings_of_file else given
        profile = given.profile(search)
    request = replace(
        ModelRequest(model, profile, given.sections, search.ranker, search.orient, profile_names=given.names),
        settings=given.given(search).settings,
        parts=search.parts,
        copies=1 if copies is None else copies,
        plate=file.plate,
        verbose=search.verbose,
        **further,
    )
    return request if project is None else project.applied(request, Path(model), copies)


def _over_project(
    given: ProfileOptions, of_project: Given, search: SearchOptions, model: str
) -> "tuple[ProfileOptions, Profile]":
    """The options on top of a project's, and their profile. Raises ProfileError, which names the project if that is at fault."""
    from profiles.errors import ProfileError

    given.profile(search)
    both = given.over(of_project)
    try:
        return both, both.profile(search)
    except ProfileError as error:
        raise ProfileError(f"{model}: {error}") from None


def _given_by(model: str, given: ProfileOptions) -> Given:
    """Settings inside a slicer file for the profiles that no option names; prints a note on how many are used.

    Raises ProfileError if the model has no settings, or if both profiles are named.
    """
    from machine.notices import say
    from machine.pipeline.embedded_profile import settings_inside
    from profiles.errors import ProfileError

    file, kinds = Path(model), [kind for kind in ("material", "process") if getattr(given, kind) is None]
    if not kinds:
        raise ProfileError(
            "--settings-of-file: --material and --process name both profiles, so none of its settings would be used"
        )
    try:
        inside, note = settings_inside(file, file.name, kinds)
    except ProfileError as error:
        raise ProfileError(f"--settings-of-file: {error}") from None
    say(note)
    return inside


def program_request(models: list[str], program: ProgramOptions, given: ProfileOptions, **further: Any) -> ModelRequest:
    """The request for a plate of models or a G-code file. Raises PlanError, SliceError, ProfileError."""
    from machine.pipeline.project import is_project
    from machine.planning.stops import parse_stops

    stops = parse_stops(program.pause, program.filament_change)
    first, *others = named_models(models)
    if program.settings_of_file and len({first, *others}) > 1:
        several = ", ".join(dict.fromkeys((first, *others)))
        raise PlanError(f"--settings-of-file goes with one model, and several are given: {several}")
    for name in models if len(models) > 1 or others else ():
        if len(models) == 1 and is_project(Path(first)):
            raise PlanError(f"{name}: {first} is a project, which is a plate of its own: --copies N prints more")
        if is_project(Path(named_models([name])[0])):
            raise PlanError(f"{name} is a project, which is a plate of its own: no model goes beside it; --copies N prints more")
    return model_request(first, program, given, program.copies, plans=program.plan, stops=stops, beside=tuple(others), **further)


def machine_profile(machine: str, settings: tuple[str, ...] = ()) -> "Profile":
    """A profile in which only the machine matters."""
    return ProfileOptions(machine, settings=settings).profile()
