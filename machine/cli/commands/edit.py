"""The edit command: serves the workbench until Ctrl-C."""

from collections.abc import Callable, Coroutine
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from machine.cli.terminal.requests import EditRequest
from machine.notices import say, show
from machine.pipeline.project import is_project
from machine.pipeline.requests import GCODE_SUFFIXES
from machine.view.serving.browser import lead_browser
from machine.workbench.access.network import Lan, open_lan
from machine.workbench.session.session import Session
from machine.workbench.web.serve import serve_workbench
from machine.workbench.work.worker_pool import WorkerPools
from mdp.model_file import DEMO, check_file, locate, plan_beside
from mdp.search.plan_file import PlanFile
from mdp.search.plan_reading import read_plan
from profiles.errors import MeshError, OutputError, PlanError

PLAN_SUFFIX = ".toml"


Begin = Callable[[Session], Coroutine[Any, Any, None]]  # opens the first model


def edit(request: EditRequest) -> int:
    """Serve the page. A missing file is reported at once, an unreadable model in the page."""
    opening = None if request.model is None else _find(request.model)
    profile, given = request.given.profile(), request.given.given()
    lan = _lan(request)

    def make(pools: WorkerPools) -> Session:
        return Session(profile, given, pools)

    def begin(session: Session) -> None:
        if opening is not None:
            session.command(partial(opening, session))

    def announce(address: str, *of_lan: str) -> None:
        show("".join(f"{each}\n" for each in (address, *of_lan)))
        say(f"the workbench is open at this address{'' if of_lan else ', for this computer only'}; Ctrl-C closes it")
        if not request.no_browser:
            lead_browser(address, until_end)

    with ExitStack() as until_end:
        serve_workbench(make, begin, announce, request.port, request.upload_mib, lan)
    return 0


def _lan(request: EditRequest) -> Lan | None:
    """The network that the workbench is opened to, or None. Raises OutputError."""
    if request.lan:
        return open_lan(request.certificate, request.key)
    if request.certificate or request.key:
        raise OutputError("--certificate and --key need --lan: add it")
    return None


async def _open_model(session: Session, path: Path, name: str, plan: PlanFile | None) -> None:
    """Open a model, and cut it by the plan if there is one."""
    await session.open_model(path, name)
    if plan is not None:
        await session.take_plan(plan)


def _find(model: str) -> Begin:
    """Return the function that opens a model, a plan or a project. Raises UserError if the file does not exist."""
    if Path(model).suffix.lower() == PLAN_SUFFIX and not model.startswith(DEMO):
        return _of_plan(Path(model), read_plan(Path(model)))
    if Path(model).suffix.lower() in GCODE_SUFFIXES:
        raise MeshError(f"{model} is G-code, which is sliced already: tiltprint view shows it")
    path = locate(model)
    check_file(path)
    if is_project(path):
        return lambda session: session.open_project(path, path.name)
    file = plan_beside(model)
    plan = None if file is None else read_plan(file)
    return partial(_open_model, path=path, name=model if model.startswith(DEMO) else path.name, plan=plan)


def _of_plan(file: Path, plan: PlanFile) -> Begin:
    """Return the function that opens the model named by a plan: a shipped one, or the file of that name beside the plan."""
    path = locate(plan.model) if plan.model.startswith(DEMO) else file.parent / Path(plan.model).name
    if not plan.model or not path.is_file():
        reason = f"its model {plan.model} is not beside it" if plan.model else "it names no model"
        raise PlanError(f"plan {file}: {reason}: open the model first, then choose the plan in the page")
    return partial(_open_model, path=path, name=plan.model, plan=plan)
