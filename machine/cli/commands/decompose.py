"""The decompose command: a model's parts as files, pictures and tables, with advice on the best way to print it."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from machine.cli.terminal.report import (
    compare_table,
    estimates,
    joints_table,
    part_settings_lines,
    parts_table,
    table,
    written_line,
)
from machine.notices import show
from machine.pipeline import compilers
from machine.pipeline.choice import in_parts
from machine.pipeline.comparison import alternatives_json, compare_with_one_part
from machine.pipeline.output import PLAN, check_model_files, save_parts, write_bytes, write_json
from machine.pipeline.pictures import contact_sheet, front_picture, parts_picture, write_png
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.project import with_meshes
from machine.pipeline.requests import STDOUT, ModelRequest, Outputs
from machine.quantities import amount, percent
from machine.view.page import parts_page
from mdp.decomposition import Decomposition, FrontRow
from mdp.joint import joints_of
from mdp.save import json_values
from mdp.search.front import ASKED, BY_PLAN, Weights, choose
from mdp.search.plan_writing import plan_text
from profiles.profile import Profile


def decompose(request: ModelRequest) -> int:
    """Find the parts of a model and write the requested outputs; a comparison slices the parts, and the model in one part."""
    outputs = request.outputs
    check_model_files(request, ())
    decomposed = decompose_model(request)
    decomposition, profile = decomposed.decomposition, decomposed.profile
    alternatives = compare_with_one_part(build(decomposition, profile), profile) if request.compare else ()
    joints = alternatives[0].joints if alternatives else joints_of(decomposition.parts, profile)
    figures = json_values(decomposition, joints, decomposed.read_s, decomposed.total_s)
    figures |= {"rotate_deg": profile.process.rotate_deg}
    if alternatives:
        figures |= {"compare": alternatives_json(alternatives)}
    if outputs.folder is not None:
        save_parts(outputs.folder, decomposition, figures)
    for file in (outputs.plan, None if outputs.folder is None else outputs.folder / PLAN):
        if file is not None and not _is_same(file, request.plan):
            plan = with_meshes(decomposed.plan, file.parent) if request.project else decomposed.plan
            write_bytes(file, plan_text(plan, file.parent).encode())
    _draw(outputs, decomposition, profile)
    if outputs.html is not None:
        write_bytes(outputs.html, parts_page(decomposition, profile, alternatives))
    if outputs.json is not None:
        write_json(outputs.json, figures)
    if outputs.json != STDOUT:
        search, angle_deg = profile.search, profile.process.self_supporting_angle_deg
        tables = parts_table(decomposition, angle_deg, search.count_platform_faces, request.verbose)
        comparison = compare_table(alternatives) if alternatives else ""
        written = [outputs.folder, *(file for file in outputs.files.values() if file is not None)]
        ending = written_line(written, _verdict(request, decomposition)) if any(written) else ""
        show(tables + joints_table(joints) + part_settings_lines(profile) + advice(decomposition, profile) + comparison + ending)
    return 0


def _verdict(request: ModelRequest, decomposition: Decomposition) -> str:
    """The area that needs support in the parts, and the command that exports them."""
    plan = request.outputs.plan or request.plan or (request.outputs.folder and request.outputs.folder / PLAN)
    command = shlex.join(["tiltprint", "export", request.model, *(["--plan", str(plan)] if plan else [])])
    return (
        f"{in_parts(len(decomposition.parts))}, {amount(decomposition.residual_area_mm2, 0)} mm² need support; "
        f"{command} makes the G-code"
    )


def _is_same(file: Path, plan: Path | None) -> bool:
    """Whether a file is the plan that defined the cuts, which stays as the user wrote it."""
    return plan is not None and file.resolve() == plan.resolve()


def _draw(outputs: Outputs, decomposition: Decomposition, profile: Profile) -> None:
    png, sheet, front = outputs.png, outputs.sheet, outputs.front
    if png is not None or sheet is not None or front is not None:
        compilers.wait_for(compilers.PICTURES)
    if png is not None:
        write_png(png, parts_picture(decomposition, profile))
    if sheet is not None:
        write_png(sheet, contact_sheet(decomposition, profile.machine))
    if front is not None:
        write_png(front, front_picture(decomposition, profile))


def advice(decomposition: Decomposition, profile: Profile) -> str:
    """Table of support, time and filament in one part, in the chosen parts and in the cheapest parts, and a line with the
    best."""
    advised = _advised(decomposition, profile)
    rows = [row for row in decomposition.front if row.parts == 1 or row.chosen or row is advised] or _without_front(decomposition)
    ways = [(in_parts(row.parts), row) for row in rows]
    best = f"print it {in_parts(advised.parts if advised else len(decomposition.parts))}"
    if advised is not None and not advised.chosen:
        best += f": --parts {advised.parts}"
    return _ways_table(ways) + f"best: {best}\n"


def _advised(decomposition: Decomposition, profile: Profile) -> FrontRow | None:
    """The chosen row, or the cheapest one if the user chose; None without a front."""
    chosen, front = decomposition.chosen, decomposition.front
    if chosen is None or chosen.reason not in (ASKED, BY_PLAN):
        return chosen
    search = profile.search
    return front[choose(front, Weights.of(profile), search.least_saving).place]


def _without_front(decomposition: Decomposition) -> list[FrontRow]:
    """Rows for parts that come from no search."""
    whole = FrontRow((), decomposition.risky_area_mm2, 0.0, decomposition.risky_area_mm2)
    planes = tuple(part.base for part in decomposition.parts[1:])
    parts = FrontRow(planes, decomposition.residual_area_mm2, 0.0, decomposition.residual_area_mm2)
    return [whole, parts] if planes else [whole]


def _ways_table(ways: Sequence[tuple[str, FrontRow]]) -> str:
    """Table with support area, saving against the first row, seams, stair-stepping, time and filament of each way."""
    first_mm2 = ways[0][1].support_area_mm2
    rows = [["print it", "needs support mm²", "less", "seams mm", "stair-stepping mm²", "cost mm²", "time", "filament m"]]
    for number, (name, row) in enumerate(ways):
        less = 1.0 - row.support_area_mm2 / first_mm2 if first_mm2 > 0.0 else 0.0
        share = f"{percent(less, 1)} %" if number else ""
        areas = [amount(row.support_area_mm2, 1), share, amount(row.seam_mm, 0), amount(row.stairs_mm2, 0)]
        rows.append([name, *areas, amount(row.cost_mm2, 1), *estimates(row)])
    return table(rows)
