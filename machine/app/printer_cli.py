"""The command line of the printer: print, resume, ports, console, simulator. Heavy imports stay inside the commands."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from machine.app.options import (
    BeamWidth,
    MachineGiven,
    MachineName,
    MaterialGiven,
    ModelOrGcode,
    Orient,
    ProcessGiven,
    RankerName,
    SearchName,
    Settings,
    TimeLimit,
    profile_of,
    sections_named,
)

Watch = Annotated[bool, typer.Option("--watch", help="serve a page on this computer that follows the print")]
WatchPort = Annotated[
    int | None, typer.Option("--watch-port", metavar="N", min=0, max=65535, help="serve it on this port; else on any free one")
]


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
    watch: Watch = False,
    watch_port: WatchPort = None,
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
    """Print a model or a G-code file on a printer or a simulated one.

    PORT is a device (see ports), socket://HOST:PORT or rfc2217://HOST:PORT. The printer is asked who it is before anything moves.
    Keys at a terminal: p pauses, r resumes, c cancels, + - feed, [ ] flow, e emergency stop. Ctrl-C cancels safely.
    """
    from machine.app import commands

    profile = profile_of(
        machine or "generic_ac", material or "pla", process or "standard", settings, beam_width, search, time_limit
    )
    named = sections_named(machine=machine, material=material, process=process, settings=settings)
    page = _page_port(watch, watch_port)
    return commands.print_model(model, profile, ranker, orient, port, baud, speed, force, named, page, log, journal)


def _page_port(watch: bool, watch_port: int | None) -> int | None:
    """Where the page of a print is served, 0: at any free port; None: nowhere."""
    return (watch_port or 0) if watch or watch_port is not None else None


def resume(
    journal: Annotated[Path, typer.Argument(metavar="JOURNAL", help="journal of the print that was cut off")],
    port: Annotated[str, typer.Option("--port", metavar="PORT", help="serial port")],
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="bits a second")] = 115200,
    yes: Annotated[bool, typer.Option("--yes", help="go on without asking")] = False,
    watch: Watch = False,
    watch_port: WatchPort = None,
    further: Annotated[
        Path | None, typer.Option("--journal", metavar="FILE", help="journal of the rest; else a new file in the state folder")
    ] = None,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="FILE", help="what is sent and received; else a new file in the state folder")
    ] = None,
    machine: MachineGiven = None,
) -> int:
    """Go on with a print after a power cut, a crash or a pulled plug."""
    from machine.app import resume_command

    given = None if machine is None else profile_of(machine, "pla", "standard", None, None, None, None)
    return resume_command.resume(journal, port, baud, yes, given, further, log, _page_port(watch, watch_port))


def ports(
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="rate tried first, bits a second")] = 115200,
    json: Annotated[bool, typer.Option("--json", help="the list as JSON")] = False,
    ask: Annotated[
        bool, typer.Option("--ask/--no-ask", help="open each port and ask what is there; many boards restart when opened")
    ] = True,
) -> int:
    """List serial ports and what answers at each. It tells firmware, axes and rate, or why nothing answers."""
    from machine.app import ports_command

    return ports_command.ports(baud, json, ask)


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
    """Talk to a printer. Lines typed, or piped in, are sent; its answers are shown.

    /help tells what else can be typed; Ctrl-D leaves. Heaters that are on are then switched off, after a question at a terminal.
    """
    from machine.app import console_command

    profile = profile_of(machine, "pla", "standard", settings, None, None, None)
    return console_command.console(profile.machine, port, baud, speed, reports, leave_heaters, log)


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

    profile = profile_of(machine, "pla", "standard", settings, None, None, None)
    return simulator_command.serve(profile.machine, pty, tcp, faults, speed, baud, habits)


COMMANDS: dict[str, Callable[..., int]] = {
    "print": print_,
    "resume": resume,
    "ports": ports,
    "console": console,
    "simulator": simulator,
}
