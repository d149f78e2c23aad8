"""The command line of printers: print, send, follow, resume, ports, console, simulator. Heavy imports stay in the commands."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from machine.cli.terminal import options
from machine.cli.terminal.option_groups import with_option_groups
from machine.pipeline.requests import ConsoleRequest, Given, PrintRequest, SimulatorRequest

BAUD = PrintRequest.baud


def print_(
    models: options.ModelsOrGcode,
    *,
    port: options.PortOrSim,
    program: options.ProgramOptions,
    baud: options.Baud = BAUD,
    speed: options.SimSpeed = 0.0,
    watch: options.Watch = False,
    watch_port: options.WatchPort = None,
    no_browser: options.NoBrowser = False,
    log: options.LogFile = None,
    journal: Annotated[
        Path | None, typer.Option("--journal", metavar="FILE", help="for resume; else a new file in the state folder")
    ] = None,
    force: options.ForceAll = False,
    given: options.ProfileOptions,
) -> int:
    """Print models or a G-code file on a printer or a simulated one.

    PORT is a device (see ports), socket://HOST:PORT or rfc2217://HOST:PORT, or a print server: octoprint:HOST, moonraker:HOST,
    duet:HOST, to which the program is handed over first. The printer is asked who it is before anything moves.
    Keys at a terminal: p pauses, r resumes, c cancels, + - feed, [ ] flow, e emergency stop. Ctrl-C cancels safely.
    """
    from machine.cli.commands.print import print_model

    printing = PrintRequest(port, baud, speed, log, journal, options.page_port(watch, watch_port), not no_browser)
    return print_model(options.program_request(models, program, given, force=force), printing)


def send(
    file: Annotated[str, typer.Argument(metavar="FILE.gcode", help="a G-code file")],
    *,
    to: Annotated[
        str,
        typer.Option(
            "--to", metavar="SERVER", help="octoprint:HOST, moonraker:HOST or duet:HOST; HOST may be http(s)://HOST:PORT"
        ),
    ],
    start: Annotated[bool, typer.Option("--start", help="print it at once; print --port SERVER follows it, too")] = False,
    log: options.LogFile = None,
    force: options.ForceAll = False,
    given: options.ProfileOptions,
) -> int:
    """Hand a G-code file to a print server. It is dry-run and held against machine and server first.

    A key or password stands in servers.toml in the settings folder (see docs/network.md) or in the variable TILTPRINT_SERVER_KEY.
    """
    from machine.cli.commands.print import send

    return send(options.model_request(file, options.SearchOptions(), given, force=force), to, start=start, log=log)


def follow(
    server: Annotated[str, typer.Argument(metavar="SERVER", help="octoprint:HOST, moonraker:HOST or duet:HOST")],
    *,
    log: options.LogFile = None,
) -> int:
    """Follow and command what a print server prints already.

    Keys at a terminal are those of print; l, or Ctrl-C and no answer, leaves it printing. Ctrl-C twice cancels.
    """
    from machine.cli.commands.print import follow

    return follow(server, log)


def resume(
    journal: Annotated[
        Path | None, typer.Argument(metavar="[JOURNAL]", help="journal of the print that was cut off; without it they are listed")
    ] = None,
    *,
    port: Annotated[str | None, typer.Option("--port", metavar="PORT", help="serial port")] = None,
    baud: options.Baud = BAUD,
    yes: Annotated[bool, typer.Option("--yes", help="go on without asking, where nothing is in doubt")] = False,
    watch: options.Watch = False,
    watch_port: options.WatchPort = None,
    no_browser: options.NoBrowser = False,
    further: Annotated[
        Path | None, typer.Option("--journal", metavar="FILE", help="journal of the rest; else a new file in the state folder")
    ] = None,
    log: options.LogFile = None,
    machine: options.MachineGiven = None,
) -> int:
    """Go on with a print after a power cut, a crash or a pulled plug."""
    from machine.cli.commands.resume import list_resumable, resume
    from machine.link.journal import read_journal
    from profiles.errors import JournalError

    if journal is None:
        return list_resumable()
    if port is None:
        read_journal(journal)  # report an unreadable one first
        raise JournalError(f"journal {journal}: at which port is the printer? --port PORT is expected")
    named = None if machine is None else options.machine_profile(machine)
    printing = PrintRequest(port, baud, 0.0, log, further, options.page_port(watch, watch_port), not no_browser)
    return resume(journal, printing, named, yes)


def ports(
    *,
    baud: Annotated[int, typer.Option("--baud", metavar="N", help="rate tried first, bits a second")] = BAUD,
    json: Annotated[bool, typer.Option("--json", help="the list as JSON")] = False,
    ask: Annotated[
        bool, typer.Option("--ask/--no-ask", help="open each port and ask what is there; many boards restart when opened")
    ] = True,
) -> int:
    """List serial ports and what answers at each. It tells firmware, axes and rate, or why nothing answers."""
    from machine.cli.commands.ports import ports

    return ports(baud, json, ask)


def console(
    *,
    port: options.PortOrSim,
    baud: options.Baud = BAUD,
    speed: options.SimSpeed = 0.0,
    reports: Annotated[bool, typer.Option("--reports/--no-reports", help="show temperatures that the printer reports")] = True,
    leave_heaters: Annotated[
        bool, typer.Option("--leave-heaters", help="heaters stay as they are on leaving; else they are switched off")
    ] = False,
    log: options.LogFile = None,
    machine: options.MachineName = Given.machine,
    settings: options.Settings = None,
) -> int:
    """Talk to a printer. Lines typed, or piped in, are sent; its answers are shown.

    /help tells what else can be typed; Ctrl-D leaves. Heaters that are on are then switched off, after a question at a terminal.
    """
    from machine.cli.commands.console import console

    return console(ConsoleRequest(options.machine_profile(machine, settings), port, baud, speed, reports, leave_heaters, log))


def simulator(
    *,
    pty: Annotated[Path | None, typer.Option("--pty", metavar="PATH", help="a link to keep on the terminal's path")] = None,
    tcp: Annotated[int | None, typer.Option("--tcp", metavar="PORT", help="for socket://localhost:PORT; 0: a free one")] = None,
    faults: Annotated[Path | None, typer.Option("--faults", metavar="FILE", help="fault script: what goes wrong")] = None,
    speed: Annotated[float, typer.Option("--speed", metavar="X", help="X times real time; 0: as fast as possible")] = 1.0,
    baud: Annotated[int | None, typer.Option("--baud", metavar="N", help="bytes are as slow as on such a line")] = None,
    habits: Annotated[
        str | None, typer.Option("--habits", metavar="LIST", help="how the firmware was built: no-advanced-ok,no-busy,...")
    ] = None,
    ball: Annotated[
        str | None,
        typer.Option("--ball", metavar="X,Y,Z,D", help="it has a probe, and a ball on the plate: centre and diameter, mm"),
    ] = None,
    true_machine: Annotated[
        str | None, typer.Option("--true-machine", metavar="NAME|FILE", help="what its probe senses is this machine's")
    ] = None,
    machine: options.MachineName = Given.machine,
    settings: options.Settings = None,
) -> int:
    """A simulated printer for any host to print on; Ctrl-C ends it."""
    from machine.cli.commands.simulator import simulate_printer

    true = None if true_machine is None else options.machine_profile(true_machine, None)
    profile = options.machine_profile(machine, settings)
    return simulate_printer(SimulatorRequest(profile, pty, tcp, faults, speed, baud, habits or "", ball, true))


COMMANDS: dict[str, Callable[..., int]] = {
    command.__name__.rstrip("_"): with_option_groups(command)
    for command in (print_, send, follow, resume, ports, console, simulator)
}
