"""The save command: a project, one 3MF file with a model and all that decides its print."""

from pathlib import Path

from machine.notices import show
from machine.pipeline.file_roles import check_model_files
from machine.pipeline.output import check_writable, write_bytes
from machine.pipeline.pictures import parts_together, png_bytes
from machine.pipeline.pipeline import Decomposed, decompose_model
from machine.pipeline.project import PICTURE_PX, STANDING, SUFFIX, Project, figures_of, project_bytes
from machine.pipeline.requests import Given, ModelRequest
from machine.planning.stops import check_stop_parts
from mdp.model_file import DEMO
from profiles.errors import OutputError
from profiles.profile import DEFAULTS


def save(request: ModelRequest, out: Path) -> int:
    """Find the parts of a model, or cut it by its plan, and write the project. Raises OutputError."""
    if out.suffix.lower() != SUFFIX:
        raise OutputError(f"output {out}: a project is a 3MF file: a name that ends in {SUFFIX} is expected")
    check_writable(out)
    check_model_files(request, (("project", out),))
    decomposed = decompose_model(request)
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
    return Project(
        name=request.name,
        model=None if request.model.startswith(DEMO) else Path(request.model),
        given=Given(**names, settings=request.settings),
        rotation=STANDING if orientation is None else orientation,
        parts=len(decomposition.parts),
        stops=request.stops,
        copies=request.copies,
        figures=figures_of(decomposition.chosen),
        plate=request.plate,
        marks_in_plan=not request.own_marks,
    )
