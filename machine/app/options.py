"""Options: those that several commands share, and the profile that they ask for."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from profiles.profile import Profile

Model = Annotated[str, typer.Argument(metavar="MODEL", help="STL, OBJ, OFF, PLY, 3MF or GLB file, or demo:NAME")]
ModelOrGcode = Annotated[str, typer.Argument(metavar="MODEL|FILE.gcode", help="a model file, demo:NAME, or a G-code file")]
MachineName = Annotated[str, typer.Option("--machine", metavar="NAME|FILE", help="machine profile")]
MaterialName = Annotated[str, typer.Option("--material", metavar="NAME|FILE", help="material profile")]
ProcessName = Annotated[str, typer.Option("--process", metavar="NAME|FILE", help="process profile")]
MachineGiven = Annotated[
    str | None, typer.Option("--machine", metavar="NAME|FILE", help="machine profile; else the G-code file's own")
]
MaterialGiven = Annotated[str | None, typer.Option("--material", metavar="NAME|FILE", help="material profile; else the file's")]
ProcessGiven = Annotated[str | None, typer.Option("--process", metavar="NAME|FILE", help="process profile; else the file's")]
Settings = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="override a profile key; repeatable")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="write the result as JSON; - for standard output")]
HtmlFile = Annotated[Path | None, typer.Option("--html", metavar="FILE", help="page that shows it in a browser, see view")]
BeamWidth = Annotated[int | None, typer.Option("--beam-width", metavar="B", help="decompositions followed at a time")]
SearchName = Annotated[
    str | None, typer.Option("--search", metavar="best|published", help="published: as the 2020 paper searches")
]
TimeLimit = Annotated[float | None, typer.Option("--time-limit", metavar="SECONDS", help="then the best parts so far are used")]
RankerName = Annotated[str, typer.Option("--ranker", metavar="classic", help="which candidates the beam follows")]
Orient = Annotated[bool, typer.Option("--orient", help="first lay the model down the way that needs least support")]
Force = Annotated[bool, typer.Option("--force", help="go on although the dry run found errors")]


def sections_named(settings: list[str] | None, **given: str | None) -> frozenset[str]:
    """The sections of the profile that the user has said something about."""
    sections = {kind for kind, name in given.items() if name is not None}
    return frozenset(sections | {setting.partition(".")[0] for setting in settings or []})


def profile_of(
    machine: str,
    material: str,
    process: str,
    settings: list[str] | None,
    beam_width: int | None,
    search: str | None,
    time_limit_s: float | None,
) -> "Profile":
    """The profile of these names with these settings; the options of the search are settings too. Raises ProfileError."""
    from profiles.profile import load

    options = {"search.beam_width": beam_width, "search.method": search, "search.time_limit_s": time_limit_s}
    given = [f"{key}={value}" for key, value in options.items() if value is not None]
    return load(machine, material, process, [*(settings or []), *given])
