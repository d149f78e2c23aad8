"""Signatures of all commands, as typer reads them. Heavy imports stay inside the commands."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from machine.cli.terminal import options, requests
from machine.cli.terminal.options import option, with_option_groups
from machine.pipeline.requests import BAUD, Outputs


def decompose(
    model: options.Model, search: options.FileOptions, asked: requests.DecomposeOptions, given: options.ProfileOptions
) -> int:
    """Cut a model into parts, each with its own printing direction. It writes no G-code: export does, from the same options."""
    options.check_model(model)
    from machine.cli.commands.decompose import decompose

    return decompose(asked.request(model, search, given))


def export(
    models: options.Models,
    program: options.ProgramOptions,
    asked: requests.ExportOptions,
    given: options.ProfileOptions,
    out: Annotated[
        Path | None, option("-o --out OUT.gcode", "file to write, - for standard output; default: MODEL.gcode in this folder")
    ] = None,
) -> int:
    """Write the G-code of one or several models. A dry run checks it first."""
    for model in dict.fromkeys(options.named_models(models)):
        options.check_model(model)
    from machine.cli.commands.export import default_gcode, export, folder_line

    outputs = Outputs(gcode=out, json=asked.json, html=asked.html, svg=asked.svg, layer=asked.layer)
    request = options.program_request(models, program, given, outputs=outputs, compare=asked.compare, force=asked.force)
    if out is not None:
        return export(request)
    model = options.named_models(models)[0]
    return export(replace(request, outputs=replace(outputs, gcode=default_gcode(model, request))), folder_line(model))


def simulate(
    models: options.ModelsOrGcode,
    program: options.ProgramOptions,
    json: options.JsonFile = None,
    reference: Annotated[str | None, option("--model MODEL", "compare a G-code file's plastic with this model")] = None,
    html: options.HtmlFile = None,
    baud: Annotated[int | None, option("--baud N", "find moves that arrive too late over a line of N bits/s")] = None,
    *,
    given: options.ProfileOptions,
) -> int:
    """Check a model or a G-code file by a dry run. It compares the plastic with the model; exit 1 if a finding is an error."""
    from machine.cli.commands.simulate import simulate

    return simulate(options.program_request(models, program, given, outputs=Outputs(json=json, html=html)), reference, baud)


def view(
    models: options.ModelsOrGcode,
    program: options.ProgramOptions,
    out: Annotated[
        Path | None, option("-o --out VIEW.html", "page to write; default: named after the model, in this folder")
    ] = None,
    *,
    open_: Annotated[bool, option("--open", "show the page in the browser")] = False,
    compare: Annotated[bool, option("--compare", "also report time and material of a print in one part")] = False,
    given: options.ProfileOptions,
) -> int:
    """Write an HTML page of a model or a G-code file. It shows the parts, the layers, the moving machine and a report."""
    from machine.cli.commands.view import view

    return view(options.program_request(models, program, given, outputs=Outputs(html=out), compare=compare), open_)


def edit(asked: requests.EditRequest) -> int:
    """Open the workbench, a page to cut, slice and print. Only this computer can open it, unless --lan; Ctrl-C ends it."""
    from machine.cli.commands.edit import edit

    return edit(asked)


def save(
    model: options.Model,
    program: options.ProgramOptions,
    out: Annotated[Path, option("-o --out NAME.3mf", "project file to write")],
    given: options.ProfileOptions,
) -> int:
    """Write a project: one 3MF with model, plan and profiles. Every command accepts it, and other slicers open it."""
    options.check_model(model)
    from machine.cli.commands.export import save

    return save(options.program_request([model], program, given), out)


def batch(asked: requests.BatchRequest) -> int:
    """Export, decompose or estimate every model of a folder. A second run continues the first."""
    from machine.cli.commands.batch import batch

    return batch(asked)


def print_(
    models: options.ModelsOrGcode,
    program: options.ProgramOptions,
    asked: requests.PrintOptions,
    given: options.ProfileOptions,
    port: Annotated[str, option("--port PORT|sim", "serial port or print server; sim: the simulated printer")],
) -> int:
    """Print models or a G-code file on a printer or a simulated one.

    PORT is a device (the command ports lists them), socket://HOST:PORT, rfc2217://HOST:PORT, or a print server, which gets the
    program first: octoprint:HOST, moonraker:HOST or duet:HOST. The printer is identified before anything moves or heats.
    Keys at a terminal: p pause, r resume, c cancel, + - feed, [ ] flow, e emergency stop. Ctrl-C cancels safely.
    """
    from machine.cli.commands.print import print_model

    return print_model(options.program_request(models, program, given, force=asked.force), port, asked)


def send(
    file: Annotated[str, typer.Argument(metavar="FILE.gcode", help="a G-code file")],
    to: Annotated[str, option("--to SERVER", "octoprint:HOST, moonraker:HOST or duet:HOST; HOST may be http(s)://HOST:PORT")],
    *,
    start: Annotated[bool, option("--start", "start printing at once; print --port SERVER also follows it")] = False,
    log: options.LogFile = None,
    force: options.ForceAll = False,
    given: options.ProfileOptions,
) -> int:
    """Send a G-code file to a print server. It is dry-run and checked against machine and server first.

    A key or password is read from servers.toml in the settings folder (see docs/network.md) or the variable TILTPRINT_SERVER_KEY.
    """
    from machine.cli.commands.print import send

    return send(options.model_request(file, options.SearchOptions(), given, force=force), to, start=start, log=log)


def follow(
    server: Annotated[str, typer.Argument(metavar="SERVER", help="octoprint:HOST, moonraker:HOST or duet:HOST")],
    log: options.LogFile = None,
) -> int:
    """Follow and control the running print of a print server.

    Keys at a terminal are those of print; l, or Ctrl-C without an answer, leaves it printing. Ctrl-C twice cancels.
    """
    from machine.cli.commands.print import follow

    return follow(server, log)


def resume(asked: requests.ResumeOptions) -> int:
    """Resume a print after a power cut, a crash or a pulled plug."""
    from machine.cli.commands.print import list_resumable, resume
    from machine.link.journal import read_journal
    from profiles.errors import JournalError

    if asked.journal is None:
        return list_resumable()
    if asked.port is None:
        read_journal(asked.journal)  # an unreadable journal is reported first
        raise JournalError(f"journal {asked.journal}: at which port is the printer? --port PORT is expected")
    named = None if asked.machine is None else options.machine_profile(asked.machine)
    return resume(asked.journal, asked.port, asked, named)


def ports(
    baud: Annotated[int, option("--baud N", "rate to try first, bits/s")] = BAUD,
    *,
    json: Annotated[bool, option("--json", "the list as JSON")] = False,
    ask: Annotated[
        bool, option("--ask/--no-ask", "open each port and identify the printer; many boards restart when opened")
    ] = True,
) -> int:
    """List serial ports and what answers at each. Shows firmware, axes and baud rate, or why nothing answers."""
    from machine.cli.commands.console import ports

    return ports(baud, json, ask)


def console(asked: requests.ConsoleRequest) -> int:
    """Talk to a printer. Sends the lines that are typed or piped in, and shows the answers.

    /help lists further commands; Ctrl-D leaves. Heaters that are on are then switched off; at a terminal you are asked first.
    """
    from machine.cli.commands.console import console

    return console(asked, asked.given.profile().machine)


def simulator(asked: requests.SimulatorRequest) -> int:
    """Run a simulated printer for any host. Ctrl-C ends it."""
    from machine.cli.commands.simulator import simulate_printer

    return simulate_printer(asked)


def calibrate(asked: requests.CalibrationRequest) -> int:
    """Find signs, zeros and centres of the rotary axes. A few touches of a mark suffice; your own profile stores the result.

    With --port the machine goes from touch to touch and you move the tip onto the mark by keys; with --probe it measures a ball
    by itself. Without a port -o writes a program and a sheet to fill in; with --printed the values are read off a printed piece.
    """
    from machine.cli.commands.measuring.calibrate import evaluate_sheet, write_program

    out, measured, probing = asked.out, asked.measured, asked.probing
    if asked.printed:
        if out is not None or measured is not None or probing.probe or probing.port is not None or asked.directions:
            raise typer.BadParameter("--printed excludes -o, --measured, --port and --directions, which are for touches")
        return _read_off(asked)
    if asked.readings or asked.html is not None:
        raise typer.BadParameter("--readings and --html go with --printed FILE.gcode")
    if probing.probe:
        from machine.cli.commands.measuring.calibrate_probe import probe_axes

        if out is not None or measured is not None:
            raise typer.BadParameter("--probe measures by itself: -o and --measured are for touches by hand")
        if probing.port is None:
            raise typer.BadParameter("--probe needs --port PORT, or sim for the simulated printer")
        return probe_axes(asked, probing.port, probing.offset_mm, asked.given.profile())
    if probing.png is not None:
        raise typer.BadParameter("--png goes with --probe")
    if probing.port is not None:
        from machine.cli.commands.measuring.calibrate_by_keys import touch_by_keys

        if out is not None or measured is not None:
            raise typer.BadParameter(
                "--port takes the machine to the touches: -o and --measured are for a program that is sent separately"
            )
        return touch_by_keys(asked, probing.port, asked.given.profile())
    if out is not None and measured is None:
        return write_program(asked, asked.given.profile(), out)
    if measured is not None and out is None:
        return evaluate_sheet(asked, measured)
    raise typer.BadParameter("one of --port PORT, -o OUT.gcode, --measured FILE and --printed FILE.gcode is expected")


def _read_off(asked: requests.CalibrationRequest) -> int:
    """Calibrate from printed pieces: by a page, by readings, or by questions at the terminal."""
    from machine.cli.commands.measuring.calibrate_piece import ask_for_readings, correct_axes, write_page

    if asked.html is not None and not asked.readings:
        return write_page(asked, asked.printed, asked.html)
    if asked.readings and asked.html is None:
        return correct_axes(asked, asked.printed, asked.readings)
    if asked.html is None and len(asked.printed) == 1 and _is_at_terminal():
        return ask_for_readings(asked, asked.printed[0])
    raise typer.BadParameter("--printed goes with one of --readings TEXT and --html FILE; with neither a terminal asks")


def _is_at_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def coupon(asked: requests.CouponRequest) -> int:
    """Measure how well joints hold on your machine. Prints twelve bars with different joints, which you break by hand.

    Without -o and --measured the terminal asks for the loads at which the bars broke.
    """
    from machine.cli.commands.measuring.coupon import ask_for_loads, evaluate_sheet, write_program

    out, measured = asked.out, asked.measured
    if asked.report is not None and measured is None:
        raise typer.BadParameter(f"--report {asked.report} goes with --measured FILE, whose loads it reports")
    for name, file in (("--html", asked.html), ("--png", asked.png)):
        if file is not None and out is None:
            raise typer.BadParameter(f"{name} {file} goes with -o OUT.gcode, whose bars it shows")
    if out is not None and measured is None:
        return write_program(asked, out)
    if measured is not None and out is None:
        return evaluate_sheet(asked, measured)
    if out is None and _is_at_terminal():
        return ask_for_loads(asked)
    raise typer.BadParameter("one of -o OUT.gcode and --measured FILE is expected; with neither a terminal asks")


ProfileName = Annotated[str, typer.Argument(metavar="NAME", help="name of a profile, or a .toml file")]


def list_() -> int:
    """List the shipped profiles and your own."""
    from machine.cli.commands.profiles.listing import list_profiles

    return list_profiles()


def show(
    name: ProfileName,
    json: Annotated[bool, option("--json", "resolved values as JSON")] = False,
    settings: options.Settings = (),
) -> int:
    """Show the resolved values of one profile. Each key has its meaning beside it."""
    from machine.cli.commands.profiles.listing import show

    return show(name, json, settings)


def save_profile(
    name: ProfileName,
    out: Annotated[Path, option("-o --out FILE.toml", "profile to write, for --machine and the like")],
    settings: options.Settings = (),
    replace: requests.Replace = False,
) -> int:
    """Save a profile with your changes as your own. It contains the differences and inherits the rest."""
    from machine.cli.commands.profiles.listing import save

    return save(name, settings, out, replace)


def import_(asked: requests.ImportRequest) -> int:
    """Import another slicer's settings as your own profiles. Lists the settings taken, converted and left."""
    from machine.cli.commands.profiles.importing import import_profiles

    return import_profiles(asked)


def detect(asked: requests.DetectRequest) -> int:
    """Make a machine profile from the printer's firmware settings. Nothing moves: the firmware is only queried."""
    from machine.cli.commands.profiles.detection import detect

    if (asked.port is None) == (asked.file is None):
        raise typer.BadParameter("one of FILE and --port PORT is expected")
    return detect(asked)


def check(file: Annotated[Path, typer.Argument(metavar="FILE", help="a .toml profile")]) -> int:
    """Report all problems of a profile file. Exit code 1 if there are any."""
    from machine.cli.commands.profiles.listing import check

    return check(file)


def _named(*commands: Callable[..., int]) -> dict[str, Callable[..., int]]:
    return {command.__name__.rstrip("_"): with_option_groups(command) for command in commands}


COMMANDS = _named(
    *(decompose, export, simulate, view, edit, save, batch),
    *(print_, send, follow, resume, ports, console, simulator),
    *(calibrate, coupon),
)
PROFILES_COMMANDS = _named(list_, show) | {"save": with_option_groups(save_profile)} | _named(import_, detect, check)
