"""The export command, which writes G-code and a picture of a layer, and the save command, which writes a project as 3MF."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from machine.cli.terminal.report import compare_table, joints_table, print_price, print_table
from machine.dryrun.dryrun import summary
from machine.notices import say_lines, show
from machine.pipeline.comparison import alternatives_json, compare_with_one_part
from machine.pipeline.output import check_model_files, check_writable, write_bytes, write_json, write_lines
from machine.pipeline.pictures import parts_together, png_bytes
from machine.pipeline.pipeline import Decomposed, decompose_model
from machine.pipeline.programs import load_program, refuse_errors
from machine.pipeline.project import PICTURE_PX, STANDING, SUFFIX, Project, figures_of, project_bytes
from machine.pipeline.requests import STDOUT, Given, ModelRequest
from machine.planning.stops import check_stop_parts, parts_in_words
from machine.view.page import print_page
from mdp.model_file import DEMO
from profiles.errors import OutputError
from profiles.profile import DEFAULTS
from slicer.drawing import layer_svg
from slicer.paths import SlicedPart


def export(request: ModelRequest) -> int:
    """Write a model's G-code and other requested outputs; refused if the dry run finds an error, unless forced.

    The table goes to stderr if the G-code goes to stdout.
    """
    outputs = request.outputs
    if outputs.gcode == outputs.json == STDOUT:
        raise OutputError("-o - and --json -: only one of them can go to standard output")
    check_model_files(request, ())
    part, layer = parse_layer(outputs.layer, outputs.svg is not None)
    loaded = load_program(request, pictures=True)
    program, profile = loaded.program, loaded.profile
    refuse_errors(program.run.errors, request.force)
    picture = b"" if outputs.svg is None else draw_layer(program.sliced, part, layer)
    if outputs.gcode is not None:
        write_lines(outputs.gcode, program.lines)
    if outputs.svg is not None:
        write_bytes(outputs.svg, picture)
    alternatives = compare_with_one_part(program, profile) if request.compare else ()
    if outputs.html is not None:
        write_bytes(outputs.html, print_page(request.name, program, profile, alternatives=alternatives))
    if outputs.json is not None:
        comparison = {"compare": alternatives_json(alternatives)} if alternatives else {}
        write_json(outputs.json, summary(program.run) | print_price(program, profile) | comparison)
    table = print_table(program, profile)
    if alternatives:
        table += "\n" + joints_table(alternatives[0].joints) + compare_table(alternatives)
    if outputs.gcode == STDOUT:
        say_lines(table.removesuffix("\n"))
    elif outputs.json != STDOUT:
        show(table)
    return 0


def parse_layer(layer: str | None, has_file: bool) -> tuple[int, int]:
    """Parse PART:LAYER, both counted from 1; (1, 1) if the option is absent.

    Raises OutputError for other texts, and if there is no picture to draw the layer in.
    """
    if layer is None:
        return 1, 1
    if not has_file:
        raise OutputError(f"--layer {layer} says which layer to draw: --svg FILE must say where to")
    match = re.fullmatch(r"(\d{1,9}):(\d{1,9})", layer)
    if match is None:
        raise OutputError(f"--layer {layer}: PART:LAYER is expected, both counted from 1, such as 2:15")
    return int(match[1]), int(match[2])


def draw_layer(sliced: Sequence[SlicedPart], part: int, layer: int) -> bytes:
    """SVG of a layer. Raises OutputError or SliceError if the part or layer does not exist."""
    for piece in sliced:
        if piece.index == part:
            return layer_svg(piece, layer).encode()
    there = parts_in_words(max(p.index for p in sliced))
    raise OutputError(f"--layer {part}:{layer}: there is no part {part}, {there}")


def save(request: ModelRequest, out: Path) -> int:
    """Decompose a model, or cut it by its plan, and write the project. Raises OutputError."""
    if out.suffix.lower() != SUFFIX:
        raise OutputError(f"output {out}: a project is a 3MF file: a name that ends in {SUFFIX} is expected")
    check_writable(out)
    check_model_files(request, (("project", out),))
    decomposed = decompose_model(replace(request, copies=1, beside=()))
    decomposition = decomposed.decomposition
    check_stop_parts(request.stops, len(decomposition.parts))
    picture = png_bytes(parts_together(decomposition, decomposed.profile, PICTURE_PX))
    write_bytes(out, project_bytes(_project(request, decomposed), decomposed.plan, decomposition.mesh, picture))
    count = len(decomposed.plan.parts) + 1
    show(f"{out}: {request.name} in {count} part{'s' * (count > 1)}, with its plan and profiles\n")
    return 0


def _project(request: ModelRequest, decomposed: Decomposed) -> Project:
    decomposition, orientation = decomposed.decomposition, decomposed.plan.orientation
    names = {kind: name or DEFAULTS[kind] for kind, name in zip(DEFAULTS, request.profile_names, strict=True)}
    files = {name: None if name.startswith(DEMO) else Path(name) for name in (request.model, *request.beside)}
    beside = Counter(request.beside)
    copies = request.copies * (1 + beside.pop(request.model, 0))
    return Project(
        name=request.name,
        model=files[request.model],
        given=Given(**names, settings=request.settings),
        rotation=STANDING if orientation is None else orientation,
        parts=len(decomposition.parts),
        stops=request.stops,
        copies=copies,
        beside=tuple((name if files[name] is None else Path(name).name, files[name], count) for name, count in beside.items()),
        figures=figures_of(decomposition.chosen),
        plate=request.plate,
        marks_in_plan=not request.own_marks,
    )
