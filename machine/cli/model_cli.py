"""The command line of models: decompose, export, simulate, view, edit, save, batch. Heavy imports stay inside the commands."""

from collections.abc import Callable
from os.path import exists  # pathlib's raises for a name that is too long
from pathlib import Path
from typing import Annotated

import typer

from machine.cli.terminal import options
from machine.cli.terminal.option_groups import with_option_groups
from machine.pipeline.requests import UPLOAD_MIB, Cuts, Outputs


def decompose(
    model: options.Model,
    *,
    search: options.FileOptions,
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="DIR", help="folder for part-NN.stl, 3MF, JSON")] = None,
    plan: Annotated[
        Path | None, typer.Option("--plan", metavar="FILE", help="where FILE exists: cut by it without a search; else write it")
    ] = None,
    planes: Annotated[
        Path | None, typer.Option("--planes", metavar="FILE", help="planes by hand, cut first; the search finds the others")
    ] = None,
    json: options.JsonFile = None,
    png: Annotated[Path | None, typer.Option("--png", metavar="FILE", help="picture of the parts")] = None,
    sheet: Annotated[
        Path | None, typer.Option("--sheet", metavar="FILE", help="picture of the print order, tilted as printed")
    ] = None,
    front: Annotated[
        Path | None, typer.Option("--front", metavar="FILE", help="picture of how every number of parts would cut the model")
    ] = None,
    html: options.HtmlFile = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="FILE", help="what the search saw, as .npz for training")
    ] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="slice the parts: tell how their joints lie, and time and material in one part")
    ] = False,
    given: options.ProfileOptions,
) -> int:
    """Cut a model into parts, each with its own printing direction."""
    options.check_model(model)
    from machine.cli.commands.decompose import decompose

    known = plan is not None and exists(plan)
    outputs = Outputs(
        folder=out, json=json, html=html, png=png, sheet=sheet, front=front, record=record, plan=None if known else plan
    )
    cuts = Cuts((plan,) if known and plan else (), search.parts, planes)
    return decompose(options.model_request(model, search, given, outputs=outputs, cuts=cuts, compare=compare))


def export(
    models: options.Models,
    *,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT.gcode", help="G-code file to write; - for standard output")],
    program: options.ProgramOptions,
    json: options.JsonFile = None,
    svg: Annotated[Path | None, typer.Option("--svg", metavar="FILE", help="picture of one layer, see --layer")] = None,
    html: options.HtmlFile = None,
    layer: Annotated[str | None, typer.Option("--layer", metavar="PART:LAYER", help="which layer; else the first, 1:1")] = None,
    compare: Annotated[
        bool, typer.Option("--compare", help="tell also time, material, support and risky area printed in one part")
    ] = False,
    force: options.Force = False,
    given: options.ProfileOptions,
) -> int:
    """Write the G-code of one or several models, dry-run first."""
    for model in dict.fromkeys(options.named_models(models)):
        options.check_model(model)
    from machine.cli.commands.export import export

    outputs = Outputs(gcode=out, json=json, html=html, svg=svg, layer=layer)
    return export(options.program_request(models, program, given, outputs=outputs, compare=compare, force=force))


def simulate(
    models: options.ModelsOrGcode,
    *,
    program: options.ProgramOptions,
    json: options.JsonFile = None,
    reference: Annotated[
        str | None, typer.Option("--model", metavar="MODEL", help="hold a G-code file's plastic against this model")
    ] = None,
    html: options.HtmlFile = None,
    baud: Annotated[
        int | None, typer.Option("--baud", metavar="N", help="find moves that a line of N bits a second brings too late")
    ] = None,
    given: options.ProfileOptions,
) -> int:
    """Dry-run a model or a G-code file. The plastic is held against the model; exit 1 when a finding is an error."""
    from machine.cli.commands.simulate import simulate

    return simulate(options.program_request(models, program, given, outputs=Outputs(json=json, html=html)), reference, baud)


def view(
    models: options.ModelsOrGcode,
    *,
    program: options.ProgramOptions,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="VIEW.html", help="page to write; else named after the model, here")
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="show the page in the browser")] = False,
    compare: Annotated[bool, typer.Option("--compare", help="tell also time and material printed in one part")] = False,
    given: options.ProfileOptions,
) -> int:
    """Write one HTML page that shows a model or a G-code file. In it: parts, layers, the moving machine, a report."""
    from machine.cli.commands.view import view

    return view(options.program_request(models, program, given, outputs=Outputs(html=out), compare=compare), open_)


def edit(
    model: Annotated[
        str | None, typer.Argument(metavar="[MODEL|PLAN]", show_default=False, help="a model file, demo:NAME, or a plan (.toml)")
    ] = None,
    *,
    port: Annotated[
        int,
        typer.Option(
            "--port", metavar="N", min=0, max=65535, show_default=False, help="serve it on this port; else on any free one"
        ),
    ] = 0,
    no_browser: options.NoBrowser = False,
    upload_mib: Annotated[
        int, typer.Option("--upload-mib", metavar="N", min=1, max=1024, help="the largest file that is taken from a page")
    ] = UPLOAD_MIB,
    lan: Annotated[
        bool, typer.Option("--lan", help="open it to devices of the local network, too, each paired by a code that is told here")
    ] = False,
    certificate: Annotated[
        Path | None, typer.Option("--certificate", metavar="FILE", help="PEM file: encrypts --lan, with --key")
    ] = None,
    key: Annotated[Path | None, typer.Option("--key", metavar="FILE", help="PEM file: the key of the certificate")] = None,
    given: options.ProfileOptions,
) -> int:
    """Open the workbench: a page to look, cut, slice and print. It is on this computer alone, but with --lan; Ctrl-C ends it."""
    from machine.cli.commands.edit import edit
    from machine.pipeline.requests import EditRequest

    return edit(EditRequest(given.profile(), given.given(), model, port, not no_browser, upload_mib, lan, certificate, key))


def save(
    model: options.Model,
    *,
    program: options.ProgramOptions,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="NAME.3mf", help="project file to write")],
    given: options.ProfileOptions,
) -> int:
    """Write a project: one 3MF with model, plan and profiles. Every command takes it, and other slicers open it."""
    options.check_model(model)
    from machine.cli.commands.save import save

    return save(options.program_request([model], program, given), out)


def batch(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", show_default=False, help="folder of models")],
    *,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="folder for DO.csv, a row a model, and what is made")],
    do: Annotated[
        str, typer.Option("--do", metavar="decompose|export|estimate", help="what to make of each; estimate: the row alone")
    ] = "export",
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="ADDRESS", help="dask scheduler whose workers do it, as tcp://HOST:8786")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, max=1024, help="processes here; else one a core")
    ] = None,
    retries: Annotated[
        int, typer.Option("--retries", metavar="N", min=0, max=100, help="how often a model that was killed is tried again")
    ] = 2,
    limit_s: Annotated[
        float | None, typer.Option("--limit-s", metavar="SECONDS", min=1.0, help="a model that takes longer is given up")
    ] = None,
    search: options.SearchOptions,
    given: options.ProfileOptions,
) -> int:
    """Export every model of a folder, on all cores or many machines. Or decompose or estimate them; started again it goes on."""
    from machine.cli.commands.batch import batch
    from machine.pipeline.requests import BatchRequest
    from mdp.batch.pool import Workers
    from mdp.kernels.threads import THREADS

    asked = options.model_request("", search, given, cuts=Cuts(parts=search.parts))
    return batch(BatchRequest(folder, out, do, asked, Workers(scheduler, workers or THREADS, retries, limit_s)))


COMMANDS: dict[str, Callable[..., int]] = {
    command.__name__: with_option_groups(command) for command in (decompose, export, simulate, view, edit, save, batch)
}
