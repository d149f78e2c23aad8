"""The command line: parses, dispatches with explicit arguments, and turns every error into what a person can use.

Exit codes: 0 done, 1 the user can fix it, 3 a bug (log file named), 130 interrupted. Heavy imports stay inside the commands.
"""

import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer
from typer.exceptions import TyperException

from profiles.errors import UserError

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="From a mesh to a finished multi-directional print on a 5-axis printer.",
)
profiles_app = typer.Typer(rich_markup_mode=None, help="List, show and check profiles of machines, materials and processes.")
app.add_typer(profiles_app, name="profiles")

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

    profile = _profile(machine, material, process, settings, beam_width, search, time_limit)
    return commands.decompose(model, profile, ranker, orient, out, json, png, sheet, record, html)


@app.command()
def export(
    model: Model,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT.gcode", help="G-code file to write")],
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    json: JsonFile = None,
    svg: Annotated[Path | None, typer.Option("--svg", metavar="FILE", help="picture of one layer")] = None,
    html: HtmlFile = None,
    layer: Annotated[str | None, typer.Option("--layer", metavar="PART:LAYER", help="which layer, counted from 1:1")] = None,
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

    profile = _profile(machine, material, process, settings, beam_width, search, time_limit)
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
    """Dry-run a model or a G-code file, held against the model; exit 1 when a finding is an error."""
    from machine.app import commands

    profile = _profile(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = _named(machine=machine, material=material, process=process, settings=settings)
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
    """Write one HTML page that shows a model or a G-code file: parts, layers, the moving machine, a report."""
    from machine.app import view_command

    profile = _profile(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = _named(machine=machine, material=material, process=process, settings=settings)
    return view_command.view(model, profile, ranker, orient, out, open_, compare, named)


@app.command("print")
def print_(
    model: ModelOrGcode,
    port: Annotated[str, typer.Option("--port", metavar="PORT|sim", help="serial port; sim: the simulated printer")],
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="bits a second")] = 115200,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    speed: Annotated[float, typer.Option("--sim-speed", metavar="X", help="X times real time; 0: as fast as possible")] = 0.0,
    watch: Annotated[bool, typer.Option("--watch", help="serve a page on this computer that follows the print")] = False,
    watch_port: Annotated[
        int | None,
        typer.Option("--watch-port", metavar="N", min=0, max=65535, help="serve it on this port; else on any free one"),
    ] = None,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="FILE", help="what is sent and received; else a new file in the state folder")
    ] = None,
    journal: Annotated[
        Path | None, typer.Option("--journal", metavar="FILE", help="for resume; else a new file in the state folder")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="go on although dry run, printer, machine and program do not agree")
    ] = False,
    machine: MachineGiven = None,
    material: MaterialGiven = None,
    process: ProcessGiven = None,
    settings: Settings = None,
) -> int:
    """Print a model or a G-code file over a serial port, or on the simulated printer.

    PORT is a device (see ports), socket://HOST:PORT or rfc2217://HOST:PORT. The printer is asked who it is before anything moves.
    Keys at a terminal: p pauses, r resumes, c cancels, + - feed, [ ] flow, e emergency stop. Ctrl-C cancels safely.
    """
    from machine.app import commands

    profile = _profile(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = _named(machine=machine, material=material, process=process, settings=settings)
    watched = (watch_port or 0) if watch or watch_port is not None else None
    return commands.print_model(model, profile, ranker, orient, port, baud, speed, force, named, watched, log, journal)


@app.command()
def resume(
    journal: Annotated[Path, typer.Argument(metavar="JOURNAL", help="journal of the print that was cut off")],
    port: Annotated[str, typer.Option("--port", metavar="PORT", help="serial port")],
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="bits a second")] = 115200,
    yes: Annotated[bool, typer.Option("--yes", help="go on without asking")] = False,
    further: Annotated[
        Path | None, typer.Option("--journal", metavar="FILE", help="journal of the rest; else a new file in the state folder")
    ] = None,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="FILE", help="what is sent and received; else a new file in the state folder")
    ] = None,
    machine: MachineGiven = None,
) -> int:
    """Go on with a print that was cut off: by a power cut, a crash, a pulled plug."""
    from machine.app import resume_command

    given = None if machine is None else _profile(machine, "pla", "standard", None, None, None, None)
    return resume_command.resume(journal, port, baud, yes, given, further, log)


@app.command()
def ports(
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="rate tried first, bits a second")] = 115200,
    json: Annotated[bool, typer.Option("--json", help="the list as JSON")] = False,
    ask: Annotated[
        bool, typer.Option("--ask/--no-ask", help="open each port and ask what is there; many boards restart when opened")
    ] = True,
) -> int:
    """Serial ports and what answers at each: firmware, axes, rate, or why nothing does."""
    from machine.app import ports_command

    return ports_command.ports(baud, json, ask)


@app.command()
def console(
    port: Annotated[str, typer.Option("--port", metavar="PORT|sim", help="serial port; sim: the simulated printer")],
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="bits a second")] = 115200,
    speed: Annotated[float, typer.Option("--sim-speed", metavar="X", help="X times real time; 0: as fast as possible")] = 0.0,
    reports: Annotated[bool, typer.Option("--reports/--no-reports", help="show temperatures that the printer reports")] = True,
    leave_heaters: Annotated[
        bool, typer.Option("--leave-heaters", help="heaters stay as they are on leaving; else they are switched off")
    ] = False,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="FILE", help="what is sent and received; else a new file in the state folder")
    ] = None,
    machine: MachineName = "generic_ac",
    settings: Settings = None,
) -> int:
    """Talk to a printer: lines typed, or piped in, are sent; its answers are shown.

    /help tells what else can be typed; Ctrl-D leaves. Heaters that are on are then switched off, after a question at a terminal.
    """
    from machine.app import console_command

    profile = _profile(machine, "pla", "standard", settings, None, None, None)
    return console_command.console(profile.machine, port, baud, speed, reports, leave_heaters, log)


@app.command()
def simulator(
    pty: Annotated[Path | None, typer.Option("--pty", metavar="PATH", help="a link to keep on the terminal's path")] = None,
    tcp: Annotated[int | None, typer.Option("--tcp", metavar="PORT", help="for socket://localhost:PORT; 0: a free one")] = None,
    faults: Annotated[Path | None, typer.Option("--faults", metavar="FILE", help="fault script: what goes wrong")] = None,
    speed: Annotated[float, typer.Option("--speed", metavar="X", help="X times real time; 0: as fast as possible")] = 1.0,
    baud: Annotated[int | None, typer.Option("--baud", metavar="N", help="bytes are as slow as on such a line")] = None,
    habits: Annotated[
        str | None, typer.Option("--habits", metavar="LIST", help="how the firmware was built: no-advanced-ok,no-busy,...")
    ] = None,
    machine: MachineName = "generic_ac",
    settings: Settings = None,
) -> int:
    """A simulated printer for any host to print on; Ctrl-C ends it."""
    from machine.app import simulator_command

    profile = _profile(machine, "pla", "standard", settings, None, None, None)
    return simulator_command.serve(profile.machine, pty, tcp, faults, speed, baud, habits)


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
    """Find signs, zeros and centres of the rotary axes from a few touches of a mark, and keep them in your own profile."""
    from machine.app import calibrate_command

    if (out is None) == (measured is None):
        raise typer.BadParameter("one of -o OUT.gcode and --measured FILE is expected")
    if out is not None:
        profile = _profile(machine, "pla", "standard", settings, None, None, None)
        return calibrate_command.write_program(machine, profile, out, mark_height, mark_radius, replace)
    if measured is None:
        return 1
    return calibrate_command.work_out(machine, settings or [], measured, mark_height, save, replace, force)


@profiles_app.command("list")
def profiles_list() -> int:
    """The shipped profiles."""
    from machine.app import profile_commands

    return profile_commands.list_profiles()


@profiles_app.command("show")
def profiles_show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="a shipped profile or a .toml file")],
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


def _named(settings: list[str] | None, **given: str | None) -> frozenset[str]:
    """The sections of the profile that the user has said something about."""
    sections = {kind for kind, name in given.items() if name is not None}
    return frozenset(sections | {setting.partition(".")[0] for setting in settings or []})


def _profile(  # type: ignore[no-untyped-def]
    machine: str,
    material: str,
    process: str,
    settings: list[str] | None,
    beam_width: int | None,
    search: str | None,
    time_limit_s: float | None,
):
    from profiles.profile import load

    options = {"search.beam_width": beam_width, "search.method": search, "search.time_limit_s": time_limit_s}
    given = [f"{key}={value}" for key, value in options.items() if value is not None]
    return load(machine, material, process, [*(settings or []), *given])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    # numpy's library for products waits for its threads by spinning: on a busy machine that costs more than the products.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    command = typer.main.get_command(app)
    try:
        with command.make_context("tiltprint", given or ["--help"]) as context:
            code = command.invoke(context)
    except typer.Exit as done:
        return done.exit_code
    except TyperException as error:
        return _complain(_usage(error, given))
    except UserError as error:
        return _complain(str(error))
    except (KeyboardInterrupt, typer.Abort):
        return _complain("interrupted", 130)
    except BrokenPipeError:
        return 0
    except Exception as error:  # noqa: BLE001 - the one place where a bug becomes a message and a log file
        if _interrupted(error):
            return _complain("interrupted", 130)
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


def _usage(error: TyperException, given: Sequence[str]) -> str:
    """A usage error as one sentence that names what is allowed."""
    message = str(getattr(error, "format_message", lambda: str(error))()).strip().rstrip(".")
    context = getattr(error, "ctx", None)
    if context is None:
        return message
    files = [word for word in given if word.startswith("-") and Path(word).is_file()]
    if files:
        return f"{files[0]} begins with a dash: write ./{files[0]}"
    if message.startswith("No such option"):
        allowed = [option for parameter in context.command.params for option in parameter.opts if option.startswith("--")]
        return f"{message}; {context.command_path} knows {', '.join(allowed)}"
    if message.startswith("No such command"):
        return f"{message}; allowed are {', '.join(context.command.commands)}"
    for option, value in pairwise(given):
        message = message.replace(f"Invalid value for '{option}': Input", f"{option} is {value!r}: it")
    return f"{message}; see {context.command_path} --help"


def _complain(message: str, code: int = 1) -> int:
    sys.stderr.write(f"tiltprint: {message}\n")
    return code


if __name__ == "__main__":
    raise SystemExit(main())
