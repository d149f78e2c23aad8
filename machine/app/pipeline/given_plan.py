"""Given plan: the file that a person names to cut by, or to begin the search with, and what does not go with it."""

from machine.app.requests import ModelRequest
from mdp.plan_file import PlanFile, read_plan
from mdp.search.search import check_part_count
from profiles.errors import PlanError


def read_given_plan(request: ModelRequest) -> PlanFile | None:
    """The plan to cut by or the planes to start from; None: all is searched. Raises PlanError, also for options that do not go
    together."""
    cuts, record = request.cuts, request.outputs.record
    if cuts.parts is not None:
        check_part_count(cuts.parts)
    if cuts.plan is not None and cuts.planes is not None:
        raise PlanError(f"--planes {cuts.planes}: --plan {cuts.plan} exists, so nothing is searched; one of them is allowed")
    if cuts.plan is not None and record is not None:
        raise PlanError(f"--record {record}: --plan {cuts.plan} exists, so nothing is searched that could be recorded")
    if cuts.planes is not None and request.orient:
        raise PlanError(f"--orient: the planes of {cuts.planes} belong to the model as it lies; process.rotate_deg turns it")
    file = cuts.plan or cuts.planes
    return None if file is None else read_plan(file)


def refuse_cuts(request: ModelRequest) -> None:
    """Raise PlanError where a G-code file is to be cut."""
    for option, value in (("--plan", request.cuts.plan), ("--parts", request.cuts.parts)):
        if value is not None:
            raise PlanError(f"{option} {value}: {request.model} is G-code, which is cut already; it goes with a model")
