"""Options: those that several commands share, and what they ask for together."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from machine.app.terminal.completion import names_of

if TYPE_CHECKING:
    from profiles.profile import Profile


def _profile_option(kind: str, otherwise: str = "") -> Any:
    return typer.Option(f"--{kind}", metavar="NAME|FILE", autocompletion=names_of(kind), help=f"{kind} profile{otherwise}")


Model = Annotated[str, typer.Argument(metavar="MODEL", help="STL, OBJ, OFF, PLY, 3MF, GLB, glTF, STEP or DAE file, or demo:NAME")]
ModelOrGcode = Annotated[str, typer.Argument(metavar="MODEL|FILE.gcode", help="a model file, demo:NAME, or a G-code file")]
MachineName = Annotated[str, _profile_option("machine")]
MaterialName = Annotated[str, _profile_option("material")]
ProcessName = Annotated[str, _profile_option("process")]
MachineGiven = Annotated[str | None, _profile_option("machine", "; else the G-code file's own")]
MaterialGiven = Annotated[str | None, _profile_option("material", "; else the file's")]
ProcessGiven = Annotated[str | None, _profile_option("process", "; else the file's")]
Settings = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="override a profile key; repeatable")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="write the result as JSON; - for standard output")]
HtmlFile = Annotated[Path | None, typer.Option("--html", metavar="FILE", help="page that shows it in a browser, see view")]
BeamWidth = Annotated[int | None, typer.Option("--beam-width", metavar="B", help="decompositions followed at a time")]
SearchName = Annotated[
    str | None, typer.Option("--search", metavar="best|published", help="published: as the 2020 paper searches")
]
TimeLimit = Annotated[float | None, typer.Option("--time-limit", metavar="SECONDS", help="then the best parts so far are used")]
RankerName = Annotated[
    str,
    typer.Option(
        "--ranker",
        metavar="classic|learned|FILE.onnx",
        help="which candidates the beam follows: by the 2020 paper's order, by the network that ships, or by one of your own",
    ),
]
Orient = Annotated[bool, typer.Option("--orient", help="lay the model down the way that costs least, chosen with its parts")]
PlanGiven = Annotated[Path | None, typer.Option("--plan", metavar="FILE", help="cut by this plan of decompose, without a search")]
PartSettingsGiven = Annotated[
    list[str] | None,
    typer.Option("--part", metavar="N:KEY=VALUE,...", help="process keys of part N alone, as 2:walls=4; repeatable"),
]
Copies = Annotated[int, typer.Option("--copies", metavar="N", help="so many on the plate, of a model printed in one part")]
Pauses = Annotated[
    list[str] | None,
    typer.Option(
        "--pause", metavar="PART:LAYER", help="wait for a person before this layer, or at a height: 1:8.4mm; repeatable"
    ),
]
FilamentChanges = Annotated[
    list[str] | None, typer.Option("--filament-change", metavar="PART:LAYER", help="the same, for another filament; repeatable")
]
PartsGiven = Annotated[int | None, typer.Option("--parts", metavar="N", help="into N parts at most, not as many as pay")]
Force = Annotated[bool, typer.Option("--force", help="go on although the dry run found errors")]


LogFile = Annotated[
    Path | None, typer.Option("--log", metavar="FILE", help="what is sent and received; else a new file in the state folder")
]
Baud = Annotated[int, typer.Option("--baud", metavar="N", help="bits a second")]
PortOrSim = Annotated[str, typer.Option("--port", metavar="PORT|sim", help="serial port; sim: the simulated printer")]
SimSpeed = Annotated[float, typer.Option("--sim-speed", metavar="X", help="X times real time; 0: as fast as possible")]
Watch = Annotated[bool, typer.Option("--watch", help="serve a page on this computer that follows the print")]
WatchPort = Annotated[
    int | None, typer.Option("--watch-port", metavar="N", min=0, max=65535, help="serve it on this port; else on any free one")
]


def profile_of(
    machine: str | None,
    material: str | None,
    process: str | None,
    settings: Sequence[str] | None,
    part_settings: Sequence[str] | None = None,
) -> "Profile":
    """The profile of these names, the default ones where none is given, with these settings. Raises ProfileError."""
    from profiles.part_settings import parse_part_settings
    from profiles.profile import DEFAULTS, load, with_part_settings

    names = {"machine": machine, "material": material, "process": process}
    profile = load(**{kind: DEFAULTS[kind] if name is None else name for kind, name in names.items()}, settings=settings or ())
    return with_part_settings(profile, map(parse_part_settings, part_settings or ()))


def machine_profile(machine: str | None, settings: Sequence[str] | None = None) -> "Profile":
    """The same where only the machine matters."""
    return profile_of(machine, None, None, settings)


def with_search(
    settings: Sequence[str] | None, beam_width: int | None, search: str | None, time_limit_s: float | None
) -> list[str]:
    """The settings, and the options of the search, which are settings too."""
    options = {"search.beam_width": beam_width, "search.method": search, "search.time_limit_s": time_limit_s}
    return [*(settings or ()), *(f"{key}={value}" for key, value in options.items() if value is not None)]


def chosen_sections(settings: Sequence[str] | None, **names: str | None) -> frozenset[str]:
    """The sections of the profile that the user has said something about."""
    sections = {kind for kind, name in names.items() if name is not None}
    return frozenset(sections | {setting.partition(".")[0] for setting in settings or ()})


def page_port(watch: bool, watch_port: int | None) -> int | None:
    """Where the page of a print is served, 0: at any free port; None: nowhere."""
    return (watch_port or 0) if watch or watch_port is not None else None
