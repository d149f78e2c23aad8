"""Batch model: processes one model of a batch, from its file to its row, in any process."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from time import process_time

from machine.crash import bug_in_words
from machine.dryrun.dryrun import summary
from machine.notices import plain_line
from machine.pipeline.comparison import support_mm3
from machine.pipeline.output import FIGURES, MODEL, PLAN, SCENE, save_parts, write_bytes, write_lines
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.programs import refuse_errors
from machine.pipeline.project import close_projects, open_project, with_meshes, without_folders
from machine.pipeline.requests import ModelRequest
from machine.planning.fit import check_parts
from mdp.decomposition import Part
from mdp.joint import joints_of
from mdp.ranking import SUFFIX
from mdp.save import json_values, part_file
from mdp.search.plan_writing import plan_text
from profiles.errors import UserError
from profiles.places import is_file_name
from profiles.profile import Profile, load, with_part_settings
from slicer.estimate.estimate import estimate

DONE, REFUSED, FAILED = STATUSES = ("done", "refused", "failed")
BETWEEN = ";"  # separates the files of a row


@dataclass(frozen=True)
class Row:
    """Result for a model.

    status: refused for a reason that the user can fix; failed by a bug, by a time limit or because its process was killed each
    time; time_s, filament_mm, support_mm3: from the dry run of an export, else estimated; findings: codes of the dry run; files:
    written in the table's folder; core_s: processor time; inputs: digest of the model's file and the job.
    """

    model: str
    status: str = DONE
    parts: int = 0
    time_s: float = 0.0
    filament_mm: float = 0.0
    support_mm3: float = 0.0
    findings: str = ""
    sentence: str = ""
    files: str = ""
    core_s: float = 0.0
    inputs: str = ""


@dataclass(frozen=True)
class Job:
    """The work for every model. do: one of ACTIONS; asked: the request without a model; out: output folder, absolute."""

    do: str
    asked: ModelRequest
    out: Path
    digest: str


def job_of(do: str, asked: ModelRequest, out: Path) -> Job:
    """The job, with a digest of everything except the model's file on which its results depend."""
    ranker: str | bytes = asked.ranker
    if asked.ranker.endswith(SUFFIX):  # processes of a batch may have another working directory
        file = Path(asked.ranker).resolve()
        asked, ranker = replace(asked, ranker=str(file)), file.read_bytes()
    named = asked.profile_names, asked.settings, asked.profile.parts  # these take precedence over a project
    words = (
        version("tiltprint"),
        do,
        asked.profile.model_dump_json(),
        ranker,
        asked.orient,
        asked.parts,
        named,
    )
    names = (str(Path(name).resolve()) if name and is_file_name(name) else name for name in asked.profile_names)
    return Job(do, replace(asked, profile_names=tuple(names)), out, sha256(repr(words).encode()).hexdigest())


def inputs_of(file: Path, job: Job) -> str:
    """Digest of a model's file and its job; "" when the file cannot be read."""
    try:
        with file.open("rb") as content:
            digest = sha256(job.digest.encode())
            while block := content.read(1 << 20):
                digest.update(block)
    except OSError:
        return ""
    return digest.hexdigest()[:16]


def row_of(file: Path, job: Job) -> Row:
    """Process one model."""
    began, row = process_time(), Row(file.name, inputs=inputs_of(file, job))
    try:
        row = ACTIONS[job.do](request_of(str(file), job), row, job.out / file.stem)
    except UserError as error:
        row = replace(row, status=REFUSED, sentence=_sentence(str(error), file))
    except Exception as error:  # noqa: BLE001 - a bug with one model must not end the others
        row = replace(row, status=FAILED, sentence=_sentence(bug_in_words(error, [job.do, str(file)]), file))
    finally:
        close_projects()
    return replace(row, core_s=round(process_time() - began, 2))


def request_of(model: str, job: Job) -> ModelRequest:
    """The request for one model; a project provides what the batch's options leave open. Raises UserError."""
    project = open_project(model)
    if project is None:
        return replace(job.asked, model=model)
    given = project.given.replaced(job.asked.profile_names, job.asked.settings)
    profile = load(given.machine, given.material, given.process, given.settings)
    asked = replace(job.asked, profile=with_part_settings(profile, job.asked.profile.parts))
    return project.applied(asked, Path(model), 1 if job.do == "decompose" else None)


def _sentence(text: str, file: Path) -> str:
    """A message about a model without the common folder."""
    return plain_line(without_folders(text).replace(str(file), file.name))


def _estimate(request: ModelRequest, row: Row, out: Path) -> Row:
    decomposed = decompose_model(request)
    return _estimated(row, decomposed.decomposition.parts, decomposed.profile)


def _estimated(row: Row, parts: tuple[Part, ...], profile: Profile) -> Row:
    check_parts(parts, profile)
    guess = estimate(parts, profile)
    figures = (round(guess.time_s, 1), round(guess.filament_mm, 1), round(guess.support_mm3, 1))
    return replace(row, parts=len(parts), time_s=figures[0], filament_mm=figures[1], support_mm3=figures[2])


def _decompose(request: ModelRequest, row: Row, out: Path) -> Row:
    decomposed = decompose_model(request)
    decomposition, profile = decomposed.decomposition, decomposed.profile
    figures = json_values(decomposition, joints_of(decomposition.parts, profile), decomposed.read_s, decomposed.total_s)
    save_parts(out, decomposition, figures | {"rotate_deg": profile.process.rotate_deg})
    plan = with_meshes(decomposed.plan, out) if request.project else decomposed.plan
    write_bytes(out / PLAN, plan_text(plan, out).encode())
    names = (*(part_file(part.index) for part in decomposition.parts), MODEL, SCENE, FIGURES, PLAN)
    row = replace(row, parts=len(decomposition.parts), files=BETWEEN.join(f"{out.name}/{name}" for name in names))
    try:
        return _estimated(row, decomposition.parts, profile)
    except UserError as error:  # the parts can still be inspected
        return replace(row, sentence=_sentence(str(error), Path(request.model)))


def _export(request: ModelRequest, row: Row, out: Path) -> Row:
    decomposed = decompose_model(request, to_build=True)
    program = build(decomposed.decomposition, decomposed.profile, pictures=True)
    figures, run = summary(program.run), program.run
    row = replace(
        row,
        parts=figures["parts"],
        time_s=round(run.time_s, 1),
        filament_mm=round(figures["filament_mm"], 1),
        support_mm3=round(support_mm3(run), 1),
        findings=" ".join(sorted({finding.code for finding in run.findings})),
    )
    try:
        refuse_errors(run.errors, request.force)
    except UserError as error:
        return replace(row, status=REFUSED, sentence=_sentence(str(error), Path(request.model)))
    gcode = out.with_name(f"{out.name}.gcode")
    write_lines(gcode, program.lines)
    return replace(row, files=gcode.name)


ACTIONS: dict[str, Callable[[ModelRequest, Row, Path], Row]] = {"decompose": _decompose, "export": _export, "estimate": _estimate}
