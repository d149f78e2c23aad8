"""The decompose command: a model's parts as files, pictures and a table."""

from pathlib import Path

from machine.cli.terminal.advice import advice
from machine.cli.terminal.report import compare_table, joints_table, part_settings_lines, parts_table
from machine.notices import show
from machine.pipeline import compilers
from machine.pipeline.comparison import alternatives_json, compare_with_one_part
from machine.pipeline.file_roles import check_model_files
from machine.pipeline.output import PLAN, check_outputs, save_parts, write_bytes, write_json
from machine.pipeline.pictures import contact_sheet, front_picture, parts_picture, write_png
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.project import with_meshes
from machine.pipeline.requests import STDOUT, ModelRequest, Outputs
from machine.view.page import parts_page
from mdp.decomposition import Decomposition
from mdp.joint import joints_of
from mdp.save import json_values
from mdp.search.plan_writing import plan_text
from profiles.profile import Profile


def decompose(request: ModelRequest) -> int:
    """Find the parts of a model and save what is asked for; to compare them they are sliced, and the model in one part."""
    outputs = request.outputs
    check_outputs(outputs)
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
        if file is not None and not _is_same(file, request.cuts.plan):
            plan = with_meshes(decomposed.plan, file.parent) if request.project else decomposed.plan
            write_bytes(file, plan_text(plan, file.parent).encode())
    _draw(outputs, decomposition, profile)
    if outputs.html is not None:
        write_bytes(outputs.html, parts_page(decomposition, profile, alternatives))
    if outputs.json is not None:
        write_json(outputs.json, figures)
    if outputs.json != STDOUT:
        tables = parts_table(decomposition, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces)
        comparison = compare_table(alternatives) if alternatives else ""
        show(tables + joints_table(joints) + part_settings_lines(profile) + advice(decomposition, profile) + comparison)
    return 0


def _is_same(file: Path, plan: Path | None) -> bool:
    """Whether a file is the plan that was cut by: it stays as the person left it."""
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
