"""The command line: parses, dispatches with explicit arguments, and turns every error into what a person can use.

Exit codes: 0 done, 1 the user can fix it, 3 a bug (log file named), 130 interrupted. Heavy imports stay inside the commands.
"""

import errno
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from typer.exceptions import TyperException

from machine.app.interrupts import outside_compiler
from machine.app.options import (
    BeamWidth,
    Force,
    HtmlFile,
    JsonFile,
    MachineGiven,
    MachineName,
    MaterialGiven,
    MaterialName,
    Model,
    ModelOrGcode,
    Orient,
    ProcessGiven,
    ProcessName,
    RankerName,
    SearchName,
    Settings,
    TimeLimit,
    profile_of,
    sections_named,
)
from machine.app.printer_cli import COMMANDS
from machine.app.usage import sentence
from profiles.errors import UserError

FULL = (errno.ENOSPC, errno.EDQUOT)

app = typer.Typer(
    add_completion=False,
    context_settings={"max_content_width": 120},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="From a mesh to a finished multi-directional print on a 5-axis printer.",
)
profiles_app = typer.Typer(rich_markup_mode=None, help="List, show and check machines, materials and processes.")
app.add_typer(profiles_app, name="profiles")


@app.command()
def decompose(
    model: Model,
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="DIR", help="folder for part-NN.stl, 3MF, JSON")] = None,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    json: JsonFile = None,
    png: Annotated[Path | None, typer.Option("--png", metavar="FILE", help="picture of the parts")] = None,
    sheet: Annotated[
        Path | None, typer.Option("--sheet", metavar="FILE", help="picture of the print order, tilted as printed")
    ] = None,
    html: HtmlFile = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="FILE", help="what the search saw, as .npz for training")
    ] = None,
    machine: MachineName = "generic_ac",
    material: MaterialName = "pla",
    process: ProcessName = "standard",
    settings: Settings = None,
) -> int:
    """Cut a model into parts, each with its own printing direction."""
    from machine.app import commands

    profile = profile_of(machine, material, process, settings, beam_width, search, time_limit)
    return commands.decompose(model, profile, ranker, orient, out, json, png, sheet, record, html)


@app.command()
def export(
    model: Model,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT.gcode", help="G-code file to write; - for standard output")],
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    json: JsonFile = None,
    svg: Annotated[Path | None, typer.Option("--svg", metavar="FILE", help="picture of one layer, see --layer")] = None,
    html: HtmlFile = None,
    layer: Annotated[str | None, typer.Option("--layer", metavar="PART:LAYER", help="which layer; else the first, 1:1")] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="tell also time, material, support and risky area printed in one part")
    ] = False,
    force: Force = False,
    machine: MachineName = "generic_ac",
    material: MaterialName = "pla",
    process: ProcessName = "standard",
    settings: Settings = None,
) -> int:
    """Write the G-code of a model, dry-run first."""
    from machine.app import commands

    profile = profile_of(machine, material, process, settings, beam_width, search, time_limit)
    return commands.export(model, profile, ranker, orient, out, json, svg, layer, force, compare, html)


@app.command()
def simulate(
    model: ModelOrGcode,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    json: JsonFile = None,
    beside: Annotated[
        str | None, typer.Option("--model", metavar="MODEL", help="hold a G-code file's plastic against this model")
    ] = None,
    html: HtmlFile = None,
    baud: Annotated[
        int | None, typer.Option("--baud", metavar="N", help="find moves that a line of N bits a second brings too late")
    ] = None,
    machine: MachineGiven = None,
    material: MaterialGiven = None,
    process: ProcessGiven = None,
    settings: Settings = None,
) -> int:
    """Dry-run a model or a G-code file. The plastic is held against the model; exit 1 when a finding is an error."""
    from machine.app import commands

    profile = profile_of(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = sections_named(machine=machine, material=material, process=process, settings=settings)
    return commands.simulate(model, profile, ranker, orient, json, named, beside, html, baud)


@app.command()
def view(
    model: ModelOrGcode,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="VIEW.html", help="page to write; else named after the model, here")
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="show the page in the browser")] = False,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    compare: Annotated[bool, typer.Option("--compare", help="tell also time and material printed in one part")] = False,
    machine: MachineGiven = None,
    material: MaterialGiven = None,
    process: ProcessGiven = None,
    settings: Settings = None,
) -> int:
    """Write one HTML page that shows a model or a G-code file. In it: parts, layers, the moving machine, a report."""
    from machine.app import view_command

    profile = profile_of(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = sections_named(machine=machine, material=material, process=process, settings=settings)
    return view_command.view(model, profile, ranker, orient, out, open_, compare, named)


for word, command in COMMANDS.items():
    app.command(word)(command)


@app.command()
def calibrate(
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT.gcode", help="program to write, with a sheet beside it to fill in")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option("--measured", metavar="FILE", help="filled sheet, .toml or .csv: work out the numbers")
    ] = None,
    mark_height: Annotated[
        float | None, typer.Option("--mark-height", metavar="MM", min=0, max=200, help="height of the mark over the plate")
    ] = None,
    mark_radius: Annotated[
        float | None, typer.Option("--mark-radius", metavar="MM", help="distance of the mark from the middle of the plate")
    ] = None,
    save: Annotated[str | None, typer.Option("--save", metavar="NAME", help="name of your profile; else the machine's")] = None,
    replace: Annotated[bool, typer.Option("--replace", help="write over a file that exists")] = False,
    force: Annotated[bool, typer.Option("--force", help="save although the touches are far off")] = False,
    machine: MachineName = "generic_ac",
    settings: Settings = None,
) -> int:
    """Find signs, zeros and centres of the rotary axes. A few touches of a mark tell them; your own profile keeps them.

    Without -o and --measured a terminal asks for the touches one by one.
    """
    from machine.app import calibrate_command

    if out is None and measured is None and sys.stdin.isatty() and sys.stdout.isatty():
        return calibrate_command.talk(machine, settings or [], mark_height, mark_radius, save, replace, force)
    if (out is None) == (measured is None):
        raise typer.BadParameter("one of -o OUT.gcode and --measured FILE is expected; in a terminal neither, to be asked")
    if out is not None:
        profile = profile_of(machine, "pla", "standard", settings, None, None, None)
        return calibrate_command.write_program(machine, profile, out, mark_height, mark_radius, replace)
    if measured is None:
        return 1
    return calibrate_command.work_out(machine, settings or [], measured, mark_height, save, replace, force)


@profiles_app.command("list")
def profiles_list() -> int:
    """The shipped profiles and your own."""
    from machine.app import profile_commands

    return profile_commands.list_profiles()


@profiles_app.command("show")
def profiles_show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="name of a profile, or a .toml file")],
    json: Annotated[bool, typer.Option("--json", help="resolved values as JSON")] = False,
    settings: Settings = None,
) -> int:
    """Resolved values of one profile, with what each key means."""
    from machine.app import profile_commands

    return profile_commands.show(name, json, settings or [])


@profiles_app.command("check")
def profiles_check(file: Annotated[Path, typer.Argument(metavar="FILE", help="a .toml profile")]) -> int:
    """All problems of a profile file at once; exit 1 when there are any."""
    from machine.app import profile_commands

    return profile_commands.check(file)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"tiltprint {version('tiltprint')}")
        raise typer.Exit(0)


@app.callback()
def _options(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version")] = False,
) -> None:
    del version


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    # numpy's library for products waits for its threads by spinning: on a busy machine that costs more than the products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    command = typer.main.get_command(app)
    try:
        with outside_compiler(), command.make_context("tiltprint", given or ["--help"]) as context:
            code = command.invoke(context)
    except typer.Exit as done:
        return done.exit_code
    except TyperException as error:
        return _complain(sentence(error, given))
    except UserError as error:
        return _complain(str(error))
    except (KeyboardInterrupt, typer.Abort):
        return _complain("interrupted", 130)
    except BrokenPipeError:
        return 0
    except Exception as error:  # noqa: BLE001 - the one place where a bug becomes a message and a log file
        if _interrupted(error):
            return _complain("interrupted", 130)
        if isinstance(error, OSError) and error.errno in FULL:
            return _complain(f"{error.filename or 'standard output'} cannot be written: no space is left")
        from machine.app.crash import log_bug

        return _complain(f"a bug in tiltprint: {type(error).__name__}: {error}; the details are in {log_bug(error, given)}", 3)
    return int(code or 0)


def _interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C lies beneath: compiled code turns it into an error of its own."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _complain(message: str, code: int = 1) -> int:
    sys.stderr.write(f"tiltprint: {message}\n")
    return code


if __name__ == "__main__":
    raise SystemExit(main())
