"""Search: from a mesh to its ordered parts, by a beam of cuts that is polished or as published in 2020.

Otherwise than published: the best node ever seen is the result, the search goes on while any node has a useful child, a
candidate that can no longer beat it is dropped (what a cut leaves risky above its plane is never repaired later, so that sum
bounds all descendants), two orders of the same cuts take one slot, the slots of the beam differ in what they look for
(beam), and the best results are polished off the grid of candidates (polish).
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from time import perf_counter
from typing import Any

from mdp.cost.symmetry import find_mirrors
from mdp.decomposition import Decomposition, FrontRow
from mdp.joint import is_sound
from mdp.kernels.threads import ahead
from mdp.mesh import Mesh
from mdp.pedestal import on_pedestal
from mdp.plans.plan_file import PlanFile
from mdp.ranking.candidates import REASONS
from mdp.ranking.ranker import Ranker, ranker_named
from mdp.ranking.record import Trace
from mdp.search.beam import Beam, search_limbs
from mdp.search.by_hand import check_model, check_zones, cut_by_hand
from mdp.search.coarse import as_it_is, coarse_copy, cut_as_copy
from mdp.search.front import ASKED, Choice, Front, Pricing, choose, front_row, pays, price_row, price_rows
from mdp.search.node import Node
from mdp.search.parts import Outcome, Taken, made_of, make_parts
from mdp.search.polish import make_regular, polish, settle
from mdp.search.problem import Problem
from mdp.search.published import search_as_published
from mdp.sweep.limbs import cylinders_cut
from profiles.errors import PlanError
from profiles.part_settings import MOST_PARTS
from profiles.profile import Profile

NEARLY_BEST = 1.02  # times the beam's best that cuts of single limbs may cost to be polished
WITHOUT_SEAMS = {
    "hidden_seam_share": 1.0,
    "feature_mm2": 0.0,
    "feature_weight": 1.0,
    "simplify_faces": 0,
}  # what tells cuts apart


@dataclass(frozen=True)
class Progress:
    """Where the search stands: after which stage, 0 when it begins. measure: what gives the best so far as a row of the front."""

    stage: int
    beam: int
    best_share: float
    measure: Callable[[], FrontRow]


def decompose(
    mesh: Mesh,
    name: str,
    profile: Profile,
    *,
    ranker: str = "classic",
    on_stage: Callable[[Progress], None] | None = None,
    on_phase: Callable[[str], None] | None = None,
    on_record: Callable[[bytes], None] | None = None,
    by_hand: PlanFile | None = None,
    parts: int | None = None,
    price: Pricing | None = None,
) -> Decomposition:
    """Find the parts of a closed mesh standing on the platform; one part when nothing is risky or no cut is feasible.

    on_phase is told in words what is done while no stage is; on_record is given what the search looked at and what became of it,
    as the content of an .npz file. by_hand: planes that are cut first and stay, and zones; parts: the most parts, instead of as
    many as pay; price: what parts take to print, for the rows of the front and the choice between them: without it nothing is
    searched for one part. Raises PlanError for a plane by hand that cannot be cut.
    """
    began = perf_counter()
    if parts is not None:
        check_part_count(parts)
        most = max(parts, profile.search.most_parts)
        profile = profile.model_copy(update={"search": profile.search.model_copy(update={"most_parts": most})})
    uncut = parts == 1 and price is None and on_record is None  # nobody looks at the front
    if uncut:
        profile = profile.model_copy(update={"search": profile.search.model_copy(update=WITHOUT_SEAMS)})
    given, mesh = mesh, on_pedestal(mesh, profile.search.pedestal_mm)
    planned = PlanFile("") if by_hand is None else by_hand
    check_model(planned, mesh, name)
    check_zones(planned, mesh, name)
    tell = on_phase or (lambda text: None)
    measure = cache(partial(_measure, mesh, profile, planned, tell))
    if planned.parts or profile.search.time_limit_s is not None:  # refused at once, or on time; else a copy is searched before
        measure()
    if parts is not None and parts <= len(planned.parts):
        raise PlanError(f"--parts {parts}: the planes by hand of {planned.name} alone make {len(planned.parts) + 1} parts")
    copy = None if on_record is not None else _copy_to_search(given, profile, planned, tell)
    if copy is not None:
        asked: dict[str, Any] = {"ranker": ranker, "on_stage": on_stage, "on_phase": on_phase, "parts": parts, "price": price}
        with suppress(PlanError):  # of a plane by hand that cuts the mesh and not its copy
            found = decompose(copy, name, as_it_is(profile), by_hand=replace(planned, sha256=""), **asked)
            fine = cut_as_copy(measure(), found, price)
            if fine is not None:
                return fine
    problem = measure()
    trace = None if on_record is None else Trace(name, problem.model, problem.start.signature, problem.start.cost_mm2)
    report = on_stage or (lambda progress: None)
    if uncut:
        best, front, rounds = problem.root, Front(problem.root), 0
    elif profile.search.method == "published":
        _begin(problem, report)
        continues = partial(_continues, problem)
        best, rounds = search_as_published(problem, ranker_named(ranker), continues, trace, partial(_report, problem, report))
        front = Front(problem.start)
        front.offer(best)
    else:
        best, front, rounds = _search_beam(problem, ranker_named(ranker), trace, report)
    if on_record is not None and trace is not None:
        on_record(trace.to_bytes())
    taken = _take(problem, front, best, parts, price, profile)
    notes = (*_notes(problem, taken, parts), *_zone_notes(problem), *_front_note(planned))
    return made_of(problem, taken, Outcome(name, ranker, rounds, problem.evaluated, perf_counter() - began, notes))


def _measure(mesh: Mesh, profile: Profile, planned: PlanFile, tell: Callable[[str], None]) -> Problem:
    """The problem of a mesh, cut by a person's planes. Raises PlanError."""
    tell(f"measuring overhangs and seams of {len(mesh.faces):,} faces")
    problem = Problem(mesh, profile, planned.zones)
    problem.start = cut_by_hand(problem, planned)
    return problem


def _copy_to_search(mesh: Mesh, profile: Profile, planned: PlanFile, tell: Callable[[str], None]) -> Mesh | None:
    """See `coarse_copy`."""
    if 0 < profile.search.effective.simplify_faces < len(mesh.faces):
        tell(f"looking for a copy of {len(mesh.faces):,} faces with fewer of them")
    return coarse_copy(mesh, profile, planned.zones)


def _take(problem: Problem, front: Front, best: Node, wanted: int | None, price: Pricing | None, profile: Profile) -> Taken:
    """The decomposition of a front to take: of at most the wanted number of parts, else the cheapest one, with its time
    where seconds cost anything; best: the one to take where seams cost nothing. Rows that are not sound get no time, so they are
    taken only where a person asks for them."""
    nodes, parts_of = front.nodes, cache(partial(make_parts, problem))
    rows = [front_row(node) for node in nodes]
    if price is not None:
        paying = {place: parts_of(nodes[place]) for place, good in enumerate(pays(rows)) if good}
        by_hand = len(problem.start.cuts)
        sound = {place: parts for place, parts in paying.items() if is_sound(problem.mesh, parts, profile, by_hand)}
        rows = [replace(row, sound=place in sound or place not in paying) for place, row in enumerate(rows)]
        rows = price_rows(rows, sound, price)
    choice = choose(rows, problem.worth, problem.settings.least_saving)
    if wanted is not None:
        choice = Choice(nodes.index(front.up_to(wanted)), ASKED)
    elif problem.terms.seam_mm <= 0.0:
        place = next(place for place, node in enumerate(nodes) if len(node.cuts) == len(best.cuts))  # it, or its equal in cost
        choice = Choice(place, "the least risky area")
    node, row = nodes[choice.place], rows[choice.place]
    if price is not None and row.time_s is None:
        row = price_row(row, parts_of(node), price)
    rows[choice.place] = replace(row, chosen=True, reason=choice.reason)
    return Taken(parts_of(node), tuple(rows), (*_feature_notes(node), *choice.note))


def check_part_count(parts: int) -> None:
    """Raise PlanError for a number of parts that cannot be."""
    if not 1 <= parts <= MOST_PARTS:
        raise PlanError(f"--parts is {parts}: 1 to {MOST_PARTS} is allowed")


def _feature_notes(node: Node) -> tuple[str, ...]:
    """The bores that the cuts of parts pass askew."""
    notes, step = [], node
    while step.parent is not None:
        plane, before = step.cuts[-1].base, step.parent.remainder
        crossed = [cylinder for cylinder in cylinders_cut(before, before.cylinders, plane) if cylinder.is_crossed(plane)]
        if crossed:
            names = ", ".join(dict.fromkeys(cylinder.in_words for cylinder in crossed))
            notes.append(f"part {len(node.cuts) - len(step.cuts) + 2}: it is cut askew through {names}")
        step = step.parent
    return tuple(notes)


def _search_beam(
    problem: Problem, ranker: Ranker, trace: Trace | None, report: Callable[[Progress], None]
) -> tuple[Node, Front, int]:
    """The best node of a beam, the finalists polished, the best for every number of parts, and after how many stages."""
    if problem.model.risky_mm2 <= 0:
        return problem.start, Front(problem.start), 0
    beam = Beam(problem, ranker, trace)
    stage = 0
    try:
        _begin(problem, report)
        while any(beam.nodes) and _continues(problem, stage):
            stage += 1
            beam.advance()
            held = sum(node is not None for node in beam.nodes)
            _report(problem, report, stage, held, beam.best)
        limbs = search_limbs(problem, beam.first) if problem.settings.single_limb else []
        best = _polish_finalists(problem, beam, limbs, partial(_report, problem, report, stage, 1))
        if problem.settings.polish and problem.terms.seam_mm > 0.0:
            _polish_rows(problem, beam.front)
        return best, beam.front, stage
    except KeyboardInterrupt:
        problem.stop()
        raise
    finally:
        beam.close()


def _polish_finalists(problem: Problem, beam: Beam, limbs: Sequence[Node], report: Callable[[Node], None]) -> Node:
    """The best of a beam, of a search for single limbs, and of their polished finalists."""
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


def _polish_rows(problem: Problem, front: Front) -> None:
    """Move the planes of the rows of a front that may be taken to where they cost less, after a beam of two or more; then to
    necks, along flats, and symmetric where the model is."""
    for node in _paying(problem, front) if problem.settings.beam_width > 1 else ():
        front.offer(settle(problem, node))
    cut = _paying(problem, front)
    mirrors = find_mirrors(problem.mesh) if cut else []
    for node in cut:
        front.replace(node, make_regular(problem, node, mirrors))


def _paying(problem: Problem, front: Front) -> list[Node]:
    """The nodes of a front that the search has cut and that cost less than all with fewer cuts."""
    nodes = front.nodes
    return [node for node, good in zip(nodes, pays(nodes), strict=True) if good and len(node.cuts) > len(problem.start.cuts)]


def _begin(problem: Problem, report: Callable[[Progress], None]) -> None:
    """Tell that a search begins, where there is anything to search; its time limit counts from then on."""
    if _continues(problem, 0):
        report(Progress(0, 1, 1.0, partial(front_row, problem.start)))
        problem.begin()


def _report(problem: Problem, report: Callable[[Progress], None], stage: int, held: int, best: Node) -> None:
    report(Progress(stage, held, best.cost_mm2 / problem.root.cost_mm2, partial(front_row, best)))


def _continues(problem: Problem, stage: int) -> bool:
    cuts = len(problem.start.cuts) + stage
    return problem.model.risky_mm2 > 0 and cuts < problem.settings.most_parts - 1 and not problem.late()


def _notes(problem: Problem, taken: Taken, wanted: int | None) -> tuple[str, ...]:
    """What a person should know of the outcome."""
    parts = len(taken.parts)
    if problem.model.risky_mm2 <= 0 and parts == 1:
        return ("no face needs support: the model is printed as one part",)
    if problem.late():
        return (f"search.time_limit_s = {problem.settings.time_limit_s:g} ended the search; the best so far is used",)
    if len(taken.front) > 1 or parts > 1 or wanted == 1:
        return fewer_parts(wanted, parts, "the search found")
    counts = problem.refusals()
    shares = [f"{counts[why]} because {text}" for why, text in REASONS.items() if counts[why] > 0]
    return (f"no feasible cut among {sum(counts.values())} candidates: {'; '.join(shares)}",)


def fewer_parts(wanted: int | None, parts: int, where: str) -> tuple[str, ...]:
    """That there are fewer parts than were wanted, where there are."""
    return (f"--parts {wanted}: {where} no more than {parts}",) if wanted is not None and parts < wanted else ()


def _front_note(planned: PlanFile) -> tuple[str, ...]:
    """Rows that were found without these planes."""
    text = f"the [[front]] of {planned.name} is not kept: planes by hand have the others found anew, for every number of parts"
    return (text,) if planned.front else ()


def _zone_notes(problem: Problem) -> tuple[str, ...]:
    zones, terms, notes = problem.zones, problem.terms, []
    if zones.no_seam.anywhere and terms.seam_mm <= 0.0:
        notes.append("[[no_seam]] keeps no cut away where seams cost nothing (search.objective, search.seam_mm)")
    if zones.no_support.anywhere and terms.need is None:
        notes.append('[[no_support]] changes no cut where all that overhangs counts (search.objective = "risky")')
    return tuple(notes)
