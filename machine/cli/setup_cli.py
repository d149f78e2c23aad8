"""The command line of profiles, calibration and coupons. Heavy imports stay inside the commands."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from machine.cli.terminal.option_groups import with_option_groups
from machine.cli.terminal.options import (
    Baud,
    DefaultProfileOptions,
    Force,
    HtmlFile,
    MachineName,
    ProbeOptions,
    Settings,
    machine_profile,
)
from machine.pipeline.requests import CalibrationRequest, CouponRequest, DetectRequest, Given, ImportRequest

profiles_app = typer.Typer(rich_markup_mode=None, help="List, show and check machines, materials and processes.")


def calibrate(
    *,
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
    printed: Annotated[
        list[Path] | None,
        typer.Option("--printed", metavar="FILE.gcode", help="program of demo:calibration that was printed; repeatable"),
    ] = None,
    readings: Annotated[
        list[str] | None,
        typer.Option("--readings", metavar="TEXT", help="of each --printed: right,up,height of its four pads; else asked for"),
    ] = None,
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="with --printed: page to type the readings on")
    ] = None,
    save: Annotated[str | None, typer.Option("--save", metavar="NAME", help="name of your profile; else the machine's")] = None,
    replace: Annotated[bool, typer.Option("--replace", help="write over a file that exists")] = False,
    force: Annotated[bool, typer.Option("--force", help="save although touches or readings are far off")] = False,
    directions: Annotated[bool, typer.Option("--directions", help="find the directions of the axes, too")] = False,
    probing: ProbeOptions,
    machine: MachineName = Given.machine,
    settings: Settings = None,
) -> int:
    """Find signs, zeros and centres of the rotary axes. A few touches of a mark tell them; your own profile keeps them.

    With --port the machine goes from touch to touch and you take the tip onto the mark by keys; with --probe it measures a ball
    by itself. Without a port a terminal asks for the touches one by one; with --printed they are read off a printed piece.
    """
    from machine.cli.commands.measuring.calibrate import ask_for_touches, evaluate_sheet, write_program

    request = CalibrationRequest(machine, tuple(settings or ()), mark_height, mark_radius, save, replace, force, directions)
    if printed:
        if out is not None or measured is not None or probing.probe or probing.at is not None or directions:
            raise typer.BadParameter("--printed is a way of its own: -o, --measured, --port and --directions are for touches")
        return _read_off(request, printed, readings or [], html)
    if readings or html is not None:
        raise typer.BadParameter("--readings and --html go with --printed FILE.gcode")
    if probing.probe:
        from machine.cli.commands.measuring.calibrate_probe import probe_axes

        if out is not None or measured is not None:
            raise typer.BadParameter("--probe measures by itself: -o and --measured are for touches by hand")
        return probe_axes(request, probing.request(), machine_profile(machine, settings))
    if probing.png is not None:
        raise typer.BadParameter("--png goes with --probe")
    if probing.at is not None:
        from machine.cli.commands.measuring.calibrate_by_keys import touch_by_keys

        if out is not None or measured is not None:
            raise typer.BadParameter(
                "--port takes the machine to the touches: -o and --measured are for a program sent otherwise"
            )
        return touch_by_keys(request, probing.at, machine_profile(machine, settings))
    if out is not None and measured is None:
        return write_program(request, machine_profile(machine, settings), out)
    if measured is not None and out is None:
        return evaluate_sheet(request, measured)
    if out is None and sys.stdin.isatty() and sys.stdout.isatty():
        return ask_for_touches(request)
    raise typer.BadParameter("one of -o OUT.gcode and --measured FILE is expected; in a terminal neither, to be asked")


def _read_off(request: CalibrationRequest, printed: list[Path], readings: list[str], html: Path | None) -> int:
    """From pieces that were printed: by a page, by readings, or by what a terminal asks for."""
    from machine.cli.commands.measuring.calibrate_piece import ask_for_readings, correct_axes, write_page

    if html is not None and not readings:
        return write_page(request, printed, html)
    if readings and html is None:
        return correct_axes(request, printed, readings)
    if html is None and len(printed) == 1 and sys.stdin.isatty() and sys.stdout.isatty():
        return ask_for_readings(request, printed[0])
    raise typer.BadParameter("--printed goes with one of --readings TEXT and --html FILE; in a terminal with neither")


def coupon(
    *,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT.gcode", help="program to write, with a sheet beside it to fill in")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option("--measured", metavar="FILE", help="filled sheet, .toml: work out what holds, and save it")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE.md", help="with --measured: only write it as a table; - for standard output"),
    ] = None,
    shape: Annotated[
        str, typer.Option("--shape", metavar="bend|tensile", help="bars for a luggage scale, or ISO 527-2 type 5A")
    ] = "bend",
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="KEY=VALUE", help="what half of the bars have, not the usual four; repeatable, at most 5"),
    ] = None,
    html: HtmlFile = None,
    png: Annotated[Path | None, typer.Option("--png", metavar="FILE", help="picture of the bars in print order")] = None,
    save: Annotated[
        str | None, typer.Option("--save", metavar="NAME", help="name of your material and process profiles; else theirs")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="write over a file that exists")] = False,
    force: Force = False,
    given: DefaultProfileOptions,
) -> int:
    """Measure how joints hold on your machine. Twelve bars with different joints are printed at once, and broken by hand.

    Without -o and --measured a terminal asks for the loads at which the bars broke.
    """
    from machine.cli.commands.measuring.coupon import ask_for_loads, evaluate_sheet, write_program

    names = (given.machine, given.material, given.process)
    settings, varied = tuple(given.settings or ()), tuple(vary or ())
    request = CouponRequest(names, settings, shape, varied, html, png, report, save, replace, force)
    if report is not None and measured is None:
        raise typer.BadParameter(f"--report {report} goes with --measured FILE, whose loads it tells")
    for option, file in (("--html", html), ("--png", png)):
        if file is not None and out is None:
            raise typer.BadParameter(f"{option} {file} goes with -o OUT.gcode, whose bars it shows")
    if out is not None and measured is None:
        return write_program(request, out)
    if measured is not None and out is None:
        return evaluate_sheet(request, measured)
    if out is None and sys.stdin.isatty() and sys.stdout.isatty():
        return ask_for_loads(request)
    raise typer.BadParameter("one of -o OUT.gcode and --measured FILE is expected; in a terminal neither, to be asked")


COMMANDS = {command.__name__: with_option_groups(command) for command in (calibrate, coupon)}


@profiles_app.command("list")
def profiles_list() -> int:
    """The shipped profiles and your own."""
    from machine.cli.commands.profiles.listing import list_profiles

    return list_profiles()


@profiles_app.command("show")
def profiles_show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="name of a profile, or a .toml file")],
    *,
    json: Annotated[bool, typer.Option("--json", help="resolved values as JSON")] = False,
    settings: Settings = None,
) -> int:
    """Resolved values of one profile, with what each key means."""
    from machine.cli.commands.profiles.listing import show

    return show(name, json, settings or [])


@profiles_app.command("save")
def profiles_save(
    name: Annotated[str, typer.Argument(metavar="NAME", help="name of a profile, or a .toml file")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE.toml", help="profile to write, for --machine and the like")],
    settings: Settings = None,
) -> int:
    """A profile with changes of yours as a profile of your own, that says what differs and inherits the rest."""
    from machine.cli.commands.profiles.listing import save

    return save(name, settings or [], out)


@profiles_app.command("import")
def profiles_import(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="config.ini, bundle or G-code of PrusaSlicer; JSON of OrcaSlicer; .curaprofile")
    ],
    *,
    process: Annotated[str, typer.Option("--process-preset", metavar="NAME", help="of a bundle's print presets")] = "",
    material: Annotated[str, typer.Option("--material-preset", metavar="NAME", help="of a bundle's filament presets")] = "",
    printer: Annotated[str, typer.Option("--printer-preset", metavar="NAME", help="of a bundle's printers, for its nozzle")] = "",
    name: Annotated[str, typer.Option("--name", metavar="NAME", help="of both profiles; else as there")] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="FOLDER", help="where to; else your own profiles")] = None,
    replace: Annotated[bool, typer.Option("--replace", help="write over a file that exists")] = False,
    json: Annotated[bool, typer.Option("--json", help="what became of every setting as JSON")] = False,
) -> int:
    """Another slicer's settings as a material and a process of yours, with what was taken, worked out and left."""
    from machine.cli.commands.profiles.importing import import_profiles

    presets = {"process": process, "material": material, "printer": printer}
    return import_profiles(ImportRequest(file, presets, name, out, replace, json))


@profiles_app.command("detect")
def profiles_detect(
    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="printer.cfg, config.g, a log of M503, a dump of $$, LinuxCNC's .ini"),
    ] = None,
    *,
    port: Annotated[
        str | None, typer.Option("--port", metavar="PORT", help="of a printer; moonraker:HOST, duet:HOST; or sim")
    ] = None,
    baud: Baud = DetectRequest.baud,
    base: Annotated[str | None, typer.Option("--base", metavar="NAME", help="inherit it, else the nearest shipped one")] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE.toml", help="profile to write; else one of your own")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="write over a file that exists")] = False,
    json: Annotated[bool, typer.Option("--json", help="what was found, what not and what to measure as JSON")] = False,
) -> int:
    """A machine profile by what the printer's firmware tells of itself. Nothing moves: only questions are asked."""
    from machine.cli.commands.profiles.detection import detect

    if (port is None) == (file is None):
        raise typer.BadParameter("one of FILE and --port PORT is expected")
    return detect(DetectRequest(port, file, baud, base, out, json, replace))


@profiles_app.command("check")
def profiles_check(file: Annotated[Path, typer.Argument(metavar="FILE", help="a .toml profile")]) -> int:
    """All problems of a profile file at once; exit 1 when there are any."""
    from machine.cli.commands.profiles.listing import check

    return check(file)
