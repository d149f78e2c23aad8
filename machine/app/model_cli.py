"""The command line of models: decompose, export, simulate, view, edit. Heavy imports stay inside the commands."""

from collections.abc import Callable
from os.path import exists  # pathlib's raises for a name that is too long
from pathlib import Path
from typing import Annotated

import typer

from machine.app.requests import UPLOAD_MIB, Cuts, ModelRequest, Outputs
from machine.app.terminal.options import (
    BeamWidth,
    Copies,
    FilamentChanges,
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
    PartSettingsGiven,
    PartsGiven,
    Pauses,
    PlanGiven,
    ProcessGiven,
    ProcessName,
    RankerName,
    SearchName,
    Settings,
    TimeLimit,
    chosen_sections,
    profile_of,
    with_search,
)


def decompose(
    model: Model,
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="DIR", help="folder for part-NN.stl, 3MF, JSON")] = None,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    plan: Annotated[
        Path | None, typer.Option("--plan", metavar="FILE", help="where FILE exists: cut by it without a search; else write it")
    ] = None,
    planes: Annotated[
        Path | None, typer.Option("--planes", metavar="FILE", help="planes by hand, cut first; the search finds the others")
    ] = None,
    parts: PartsGiven = None,
    part: PartSettingsGiven = None,
    json: JsonFile = None,
    png: Annotated[Path | None, typer.Option("--png", metavar="FILE", help="picture of the parts")] = None,
    sheet: Annotated[
        Path | None, typer.Option("--sheet", metavar="FILE", help="picture of the print order, tilted as printed")
    ] = None,
    front: Annotated[
        Path | None, typer.Option("--front", metavar="FILE", help="picture of how every number of parts would cut the model")
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
    from machine.app.commands.decompose import decompose

    profile = profile_of(machine, material, process, with_search(settings, beam_width, search, time_limit), part)
    names = (machine, material, process)
    known = plan is not None and exists(plan)
    written = None if known else plan
    outputs = Outputs(folder=out, json=json, html=html, png=png, sheet=sheet, front=front, record=record, plan=written)
    cuts = Cuts(plan if known else None, parts, planes)
    return decompose(ModelRequest(model, profile, ranker=ranker, orient=orient, outputs=outputs, cuts=cuts, profile_names=names))


def export(
    model: Model,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT.gcode", help="G-code file to write; - for standard output")],
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    plan: PlanGiven = None,
    parts: PartsGiven = None,
    part: PartSettingsGiven = None,
    pause: Pauses = None,
    filament_change: FilamentChanges = None,
    copies: Copies = 1,
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
    from machine.app.commands.export import export
    from machine.planning.stops import parse_stops

    stops = parse_stops(pause or (), filament_change or ())
    profile = profile_of(machine, material, process, with_search(settings, beam_width, search, time_limit), part)
    names = (machine, material, process)
    outputs = Outputs(gcode=out, json=json, html=html, svg=svg, layer=layer)
    cuts = Cuts(plan, parts)
    request = ModelRequest(
        model,
        profile,
        ranker=ranker,
        orient=orient,
        outputs=outputs,
        compare=compare,
        force=force,
        cuts=cuts,
        stops=stops,
        copies=copies,
        profile_names=names,
    )
    return export(request)


def simulate(
    model: ModelOrGcode,
    beam_width: BeamWidth = None,
    search: SearchName = None,
    time_limit: TimeLimit = None,
    ranker: RankerName = "classic",
    orient: Orient = False,
    plan: PlanGiven = None,
    parts: PartsGiven = None,
    part: PartSettingsGiven = None,
    pause: Pauses = None,
    filament_change: FilamentChanges = None,
    copies: Copies = 1,
    json: JsonFile = None,
    reference: Annotated[
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
    from machine.app.commands.simulate import simulate
    from machine.planning.stops import parse_stops

    stops = parse_stops(pause or (), filament_change or ())
    profile = profile_of(machine, material, process, with_search(settings, beam_width, search, time_limit), part)
    names = (machine, material, process)
    chosen = chosen_sections(settings, machine=machine, material=material, process=process)
    outputs = Outputs(json=json, html=html)
    request = ModelRequest(
        model, profile, chosen, ranker, orient, outputs, cuts=Cuts(plan, parts), stops=stops, copies=copies, profile_names=names
    )
    return simulate(request, reference, baud)


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
    plan: PlanGiven = None,
    parts: PartsGiven = None,
    part: PartSettingsGiven = None,
    pause: Pauses = None,
    filament_change: FilamentChanges = None,
    copies: Copies = 1,
    compare: Annotated[bool, typer.Option("--compare", help="tell also time and material printed in one part")] = False,
    machine: MachineGiven = None,
    material: MaterialGiven = None,
    process: ProcessGiven = None,
    settings: Settings = None,
) -> int:
    """Write one HTML page that shows a model or a G-code file. In it: parts, layers, the moving machine, a report."""
    from machine.app.commands.view import view
    from machine.planning.stops import parse_stops

    stops = parse_stops(pause or (), filament_change or ())
    profile = profile_of(machine, material, process, with_search(settings, beam_width, search, time_limit), part)
    names = (machine, material, process)
    chosen = chosen_sections(settings, machine=machine, material=material, process=process)
    request = ModelRequest(
        model,
        profile,
        chosen,
        ranker,
        orient,
        Outputs(html=out),
        compare,
        cuts=Cuts(plan, parts),
        stops=stops,
        copies=copies,
        profile_names=names,
    )
    return view(request, open_)


def edit(
    model: Annotated[
        str | None, typer.Argument(metavar="[MODEL|PLAN]", show_default=False, help="a model file, demo:NAME, or a plan (.toml)")
    ] = None,
    port: Annotated[
        int,
        typer.Option(
            "--port", metavar="N", min=0, max=65535, show_default=False, help="serve it on this port; else on any free one"
        ),
    ] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="only tell the address")] = False,
    upload_mib: Annotated[
        int, typer.Option("--upload-mib", metavar="N", min=1, max=1024, help="the largest file that is taken from a page")
    ] = UPLOAD_MIB,
    machine: MachineName = "generic_ac",
    material: MaterialName = "pla",
    process: ProcessName = "standard",
    settings: Settings = None,
) -> int:
    """Open the workbench: a page to look, cut, slice and print. It is on this computer alone; Ctrl-C ends it."""
    from machine.app.commands.edit import edit
    from machine.app.requests import EditRequest, Given

    given = Given(machine, material, process, tuple(settings or ()))
    profile = profile_of(machine, material, process, settings)
    return edit(EditRequest(profile, given, model, port, not no_browser, upload_mib))


COMMANDS: dict[str, Callable[..., int]] = {
    "decompose": decompose,
    "export": export,
    "simulate": simulate,
    "view": view,
    "edit": edit,
}
