"""Search: from a mesh to its ordered parts, by a polished beam of cuts, as published in 2020, or by a plan.

Differences to the published search: the result is the best node ever seen; the search continues while any node has a useful
child; a candidate that can no longer beat the best is dropped (risky area above a cut's plane is never repaired later, so its sum
bounds all descendants); different orders of the same cuts take one slot; the slots of the beam use different trade-offs (beam);
and the best results are polished off the grid of candidates (polish).
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

from mdp.cost.symmetry import find_mirrors
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.joint import flaw_of
from mdp.kernels.threads import ahead
from mdp.mesh import Mesh
from mdp.pedestal import on_pedestal
from mdp.ranking.candidates import REASONS, Reason
from mdp.ranking.node import Node
from mdp.ranking.ranker import CLASSIC, ranker_named
from mdp.ranking.record import Trace
from mdp.search.beam import Beam, search_as_published, search_limbs
from mdp.search.by_hand import check_plan, cut_by_hand
from mdp.search.coarse import coarse_copy, cut_as_copy
from mdp.search.front import (
    ASKED,
    BY_PLAN,
    ParetoFront,
    Pricing,
    Weights,
    choose,
    front_row,
    pareto_optimal,
    price_rows,
    with_price,
)
from mdp.search.parts import decomposition_of, make_parts
from mdp.search.plan_file import NO_PLAN, PlanFile, planned_parts
from mdp.search.polish import make_regular, polish, refine_planes
from mdp.search.problem import Problem, with_search
from mdp.sweep.limbs import cylinders_cut
from profiles.errors import PlanError
from profiles.messages import key_name, option, phrase
from profiles.part_settings import MOST_PARTS
from profiles.profile import Profile

NEARLY_BEST = 1.02  # cost limit, relative to the beam's best, for polishing the result with single limbs


# Called before the first stage and after each one, with the number of completed stages, the number of nodes in the beam, the cost
# of the best node as a share of the model's, and a function that returns the best node as a front row.
OnStage = Callable[[int, int, float, Callable[[], FrontRow]], None]


@dataclass(frozen=True)
class SearchRequest:
    """The options of a search besides the profile.

    plan: planes that are cut first and stay, and zones; parts: greatest number of parts, None for the cheapest; price: time and
    filament of parts, for the rows of the front and the choice between them; without it a search for one part does nothing.
    on_phase is called with a description of each phase outside the stages; on_record with the record of the search, the content
    of an .npz file. needs_front: whether rows with more parts than requested are used.
    """

    plan: PlanFile = NO_PLAN
    parts: int | None = None
    ranker: str = CLASSIC
    price: Pricing | None = None
    on_stage: OnStage = lambda stage, beam, best_share, measure: None
    on_phase: Callable[[str], None] = lambda text: None
    on_record: Callable[[bytes], None] | None = None
    needs_front: bool = True

    @property
    def is_whole(self) -> bool:
        """Whether the model stays in one piece and no front is needed."""
        return self.parts == 1 and (self.price is None or not self.needs_front) and self.on_record is None


ANY_PARTS = SearchRequest()


def decompose(mesh: Mesh, name: str, profile: Profile, request: SearchRequest = ANY_PARTS) -> Decomposition:
    """Find the parts of a closed mesh standing on the build plate; one part if nothing is risky or no cut is feasible. Raises
    PlanError for an infeasible user-defined plane.
    """
    began, plan, parts = perf_counter(), request.plan, request.parts
    if parts is not None:
        check_part_count(parts)
        profile = with_search(profile, most_parts=max(parts, profile.search.most_parts))
    if request.is_whole:  # terms that only compare cuts are not needed
        profile = with_search(profile, hidden_seam_share=1.0, feature_mm2=0.0, feature_weight=1.0, simplify_faces=0)
    lifted, problem = on_pedestal(mesh, profile.search.pedestal_mm), None
    check_plan(plan, lifted, name)
    if plan.parts or profile.search.time_limit_s is not None:  # refused at once, or on time; otherwise a copy is searched first
        problem = _measure(lifted, profile, request)
    if parts is not None and parts <= len(plan.parts):
        raise PlanError(f"{option('parts', parts)}: the planes by hand of {plan.name} alone make {len(plan.parts) + 1} parts")
    copy = None
    if request.on_record is None:
        copy = coarse_copy(mesh, profile, plan.zones, request.on_phase)
    if copy is not None:
        with suppress(PlanError):  # a user's plane may cut the mesh but not its copy
            copy_began, own = perf_counter(), with_search(profile, simplify_faces=0)
            on_copy = _measure(on_pedestal(copy, profile.search.pedestal_mm), own, request)
            found = _search(on_copy, name, request, copy_began)
            problem = problem or _measure(lifted, profile, request)
            fine = cut_as_copy(problem, found, request.price)
            if fine is not None:
                return fine
    return _search(problem or _measure(lifted, profile, request), name, request, began)


def _measure(mesh: Mesh, profile: Profile, request: SearchRequest) -> Problem:
    """The problem of a mesh, cut by the user's planes. Raises PlanError."""
    request.on_phase(f"measuring overhangs and seams of {len(mesh.faces):,} faces")
    problem = Problem(mesh, profile, request.plan.zones)
    problem.start = cut_by_hand(problem, request.plan)
    return problem


def _search(problem: Problem, name: str, request: SearchRequest, began: float) -> Decomposition:
    """The parts of a problem's mesh. began: start of the search, by perf_counter."""
    best, front, rounds, trace = problem.start, ParetoFront(problem.start), 0, None
    if request.on_record is not None:
        trace = Trace(name, problem.model, problem.start.signature, problem.start.cost_mm2)
    if problem.settings.method == "published" and not request.is_whole:
        _begin(problem, request)
        report = partial(_report, problem, request)
        best, rounds = search_as_published(problem, ranker_named(request.ranker), trace, report)
        front.offer(best)
    elif problem.model.risky_mm2 > 0 and not request.is_whole:
        best, front, rounds = _search_beam(problem, request, trace)
    if request.on_record is not None and trace is not None:
        request.on_record(trace.to_bytes())
    parts, rows, notes = _take(problem, front, best, request)
    notes = (*_notes(problem, len(parts), len(rows), request), *notes)
    found = decomposition_of(problem, name, parts, rows, notes)
    counts = problem.count_rejected() if len(parts) == len(rows) == 1 else {}
    rejected = tuple(f"{counts[why]} candidates: {text}" for why, text in REASONS.items() if counts.get(why))
    return replace(found, ranker=request.ranker, rounds=rounds, search_s=perf_counter() - began, rejected=rejected)


def _take(
    problem: Problem, front: ParetoFront, best: Node, request: SearchRequest
) -> tuple[tuple[Part, ...], list[FrontRow], tuple[str, ...]]:
    """Choose among a front: the parts, the front's rows with the chosen one marked, and notes. With request.parts, the row with
    at most that many parts; otherwise the cheapest one, including time if seconds have a cost. best: the choice if seams cost
    nothing. Flawed rows get no time and are chosen only on request.
    """
    nodes, price, paying = front.nodes, request.price, dict[int, tuple[Part, ...]]()
    rows = [front_row(node) for node in nodes]
    if price is not None:
        paying = {place: make_parts(problem, nodes[place]) for place, good in enumerate(pareto_optimal(rows)) if good}
        by_hand = len(problem.start.cuts)
        flaws = {place: flaw_of(problem.mesh, parts, problem.profile, by_hand) for place, parts in paying.items()}
        rows = [replace(row, flaw=flaws.get(place, "")) for place, row in enumerate(rows)]
        rows = price_rows(rows, {place: parts for place, parts in paying.items() if not flaws[place]}, price)
    choice = choose(rows, Weights.of(problem.profile), problem.settings.least_saving)
    if request.parts is not None:
        choice = replace(choice, place=nodes.index(front.up_to(request.parts)), reason=ASKED, note=())
    elif problem.terms.seam_mm <= 0.0:
        # this node, or its equal in cost
        place = next(place for place, node in enumerate(nodes) if len(node.cuts) == len(best.cuts))
        choice = replace(choice, place=place, reason="for the least area that needs support", note=())
    node, row = nodes[choice.place], rows[choice.place]
    parts = paying.get(choice.place) or make_parts(problem, node)
    if price is not None and row.time_s is None:
        rows[choice.place] = with_price(row, price(parts))
    return parts, choice.marked(rows), (*_feature_notes(node), *choice.note)


def _feature_notes(node: Node) -> list[str]:
    """Notes on the bores that cuts pass askew, in print order of the parts."""
    notes = []
    for number, (whole, plane) in enumerate(reversed(list(zip(node.path, node.planes, strict=False))), start=2):
        before = whole.remainder
        crossed = [cylinder for cylinder in cylinders_cut(before, before.cylinders, plane) if cylinder.is_crossed(plane)]
        if crossed:
            names = ", ".join(dict.fromkeys(cylinder.in_words for cylinder in crossed))
            notes.append(f"part {number}: it is cut askew through {names}")
    return notes


def _search_beam(problem: Problem, request: SearchRequest, trace: Trace | None) -> tuple[Node, ParetoFront, int]:
    """Search with a beam: the best node with polished finalists, the front, and the number of stages."""
    beam, stage = Beam(problem, ranker_named(request.ranker), trace), 0
    try:
        _begin(problem, request)
        while any(beam.nodes) and problem.continues(stage):
            stage += 1
            beam.advance()
            _report(problem, request, stage, sum(node is not None for node in beam.nodes), beam.best)
        limbs = search_limbs(problem, beam.first) if problem.settings.single_limb else []
        best = _polish_finalists(problem, beam, limbs, partial(_report, problem, request, stage, 1))
        if problem.settings.polish and problem.terms.seam_mm > 0.0:
            _polish_rows(problem, beam.front)
        return best, beam.front, stage
    except KeyboardInterrupt:
        problem.stop()
        raise
    finally:
        beam.close()


def _polish_finalists(problem: Problem, beam: Beam, limbs: Sequence[Node], report: Callable[[Node], None]) -> Node:
    """The best node among the beam, the search for single limbs, and their polished finalists."""
    best = beam.best
    finalists = beam.finalists() if problem.settings.polish and problem.model.risky_mm2 > 0 else []
    for node in limbs:
        beam.front.offer(node)
    if limbs and limbs[-1].cost_mm2 < NEARLY_BEST * best.cost_mm2:
        finalists += limbs[-1:] if finalists else []
        best = min(best, limbs[-1], key=lambda node: node.cost_mm2)
    for coming in [ahead(polish, problem, node) for node in finalists]:
        polished = coming.result()
        beam.front.offer(polished)
        best = min(best, polished, key=lambda node: (node.cost_mm2, len(node.cuts)))
        report(best)
    return best


def _polish_rows(problem: Problem, front: ParetoFront) -> None:
    """Refine the planes of the front's Pareto-optimal rows, after a beam of width two or more; then move them to necks, along
    flats, and to symmetric positions.
    """
    for node in _paying(problem, front) if problem.settings.beam_width > 1 else ():
        front.offer(refine_planes(problem, node))
    cut = _paying(problem, front)
    mirrors = find_mirrors(problem.mesh) if cut else []
    for node in cut:
        front.replace(node, make_regular(problem, node, mirrors))


def _paying(problem: Problem, front: ParetoFront) -> list[Node]:
    """The nodes of a front that the search has cut and that are Pareto-optimal."""
    nodes = front.nodes
    return [
        node for node, good in zip(nodes, pareto_optimal(nodes), strict=True) if good and len(node.cuts) > len(problem.start.cuts)
    ]


def _begin(problem: Problem, request: SearchRequest) -> None:
    """Report the start of a search if there is anything to search, and start its time limit."""
    if problem.continues(0):
        request.on_stage(0, 1, 1.0, partial(front_row, problem.start))
        problem.begin()


def _report(problem: Problem, request: SearchRequest, stage: int, beam: int, best: Node) -> None:
    request.on_stage(stage, beam, best.cost_mm2 / problem.root.cost_mm2, partial(front_row, best))


def _notes(problem: Problem, parts: int, rows: int, request: SearchRequest) -> list[str]:
    """Notes on the outcome, on zones without effect, and on the plan's front if it was searched again."""
    zones, plan, notes = problem.zones, request.plan, list[str]()
    if problem.model.risky_mm2 <= 0 and parts == 1:
        notes.append("no face needs support: the model is printed as one part")
    elif problem.late():
        notes.append(
            f"{key_name('search.time_limit_s')} = {problem.settings.time_limit_s:g} ended the search; the best so far is used"
        )
    elif rows > 1 or parts > 1 or request.parts == 1:
        notes += _fewer_parts(request.parts, parts, "the search found")
    else:
        counts = problem.count_rejected()
        worth = "the model stays in one piece: each possible cut would show a seam that costs more than the support it saves"
        by_hand = phrase("cut by hand", "decompose --planes FILE cuts it where you choose")
        notes.append(f"{worth}; {by_hand}" if counts[Reason.GAIN] else "no cut is possible: every plane was rejected")
    if zones.no_seam.anywhere and problem.terms.seam_mm <= 0.0:
        notes.append(
            f"[[no_seam]] has no effect on cuts, since seams cost nothing ({key_name('search.objective')}, "
            f"{key_name('search.seam_mm')})"
        )
    if zones.no_support.anywhere and problem.terms.need is None:
        objective = key_name("search.objective")
        notes.append(f'[[no_support]] has no effect on cuts, since every overhang counts ({objective} = "risky")')
    if plan.front:
        again = "with planes by hand, the search finds the other planes again for every number of parts"
        notes.append(f"the [[front]] of {plan.name} is not kept: {again}")
    return notes


def check_part_count(parts: int) -> None:
    """Raise PlanError for an invalid number of parts."""
    if not 1 <= parts <= MOST_PARTS:
        raise PlanError(f"{option('parts')} is {parts}: 1 to {MOST_PARTS} is allowed")


def _fewer_parts(wanted: int | None, parts: int, where: str) -> tuple[str, ...]:
    """A note that there are fewer parts than requested, if so."""
    return (f"{option('parts', wanted)}: {where} no more than {parts}",) if wanted is not None and parts < wanted else ()


def cut_by_plan(mesh: Mesh, name: str, profile: Profile, request: SearchRequest) -> Decomposition:
    """The parts of a closed mesh by the planes of a plan, without a search. request.parts: greatest number of parts of the row.

    The front consists of the plan's rows; the plan's own parts replace the row with their number, and the row that is cut is
    measured again. Raises PlanError for a plan of another model and for an infeasible plane.
    """
    began, plan, wanted = perf_counter(), request.plan, request.parts
    if wanted is not None:
        check_part_count(wanted)
        plan = replace(plan, parts=plan.row(wanted))
    for number, part in enumerate(plan.parts, start=2):
        if part.plane is None:
            missing, file = "normal" if part.normal is None else "offset_mm", plan.name or "PLAN"
            raise PlanError(
                f"{plan.label}part {number} has no {missing}: "
                f"{phrase('found by the search', f'decompose --planes {file} finds it')}"
            )
    mesh = on_pedestal(mesh, profile.search.pedestal_mm)
    check_plan(plan, mesh, name)
    problem = Problem(mesh, profile, plan.zones)
    node = cut_by_hand(problem, plan)
    rows = {len(row.planes): _as_planned(row) for row in plan.front}
    own = request.plan.parts  # the user may have changed them: they replace the row of their number if they can be cut
    known = rows.get(len(own))
    if own != plan.parts and all(part.plane is not None for part in own) and (known is None or planned_parts(known) != own):
        with suppress(PlanError):
            planes = tuple(plane for part in reversed(own) if (plane := part.plane) is not None)
            rows[len(own)] = _as_planned(replace(front_row(cut_by_hand(problem, request.plan)), planes=planes))
    rows[len(node.cuts)] = replace(front_row(node), chosen=True, reason=BY_PLAN)
    parts, front = make_parts(problem, node), [rows[count] for count in sorted(rows)]
    if request.price is not None:
        front = _priced(problem, plan, front, parts, request.price)
    notes = _fewer_parts(wanted, len(plan.parts) + 1, f"the plan {plan.name} holds")
    cut = decomposition_of(problem, name, parts, front, notes)
    return replace(cut, ranker=request.ranker, search_s=perf_counter() - began)


def _as_planned(row: FrontRow) -> FrontRow:
    """A row of a plan's front: its planes and their costs."""
    return FrontRow(row.planes, row.support_area_mm2, row.seam_mm, row.cost_mm2, stairs_mm2=row.stairs_mm2)


def _priced(
    problem: Problem, plan: PlanFile, rows: Sequence[FrontRow], chosen: tuple[Part, ...], price: Pricing
) -> list[FrontRow]:
    """The rows of a plan's front with time and filament; rows that cannot be cut again or are flawed stay as they are."""
    parts: dict[int, Sequence[Part]] = {}
    for place, (row, good) in enumerate(zip(rows, pareto_optimal(rows), strict=True)):
        with suppress(PlanError):
            if row.chosen:
                parts[place] = chosen
            elif good:
                parts[place] = make_parts(problem, cut_by_hand(problem, replace(plan, parts=planned_parts(row))))
    flaws = {place: flaw_of(problem.mesh, of_row, problem.profile) for place, of_row in parts.items()}
    rows = [replace(row, flaw=flaws.get(place, "")) for place, row in enumerate(rows)]
    return price_rows(rows, {place: parts[place] for place in parts if not flaws[place] or rows[place].chosen}, price)
