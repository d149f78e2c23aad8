"""Coarse copy: a model with many faces is searched on a simplified copy, and the resulting planes cut the model itself.

All the search's criteria refer to features many layers wide, and the copy's surface lies within one layer of the model's, or
within one and a half if many faces remain; nearly all of it within half a layer. Support, cost and time of the parts are computed
on the model itself; the rows of the front that are not chosen keep the copy's figures.
"""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

from mdp.cut import simplify
from mdp.decomposition import Decomposition, FrontRow
from mdp.mesh import Mesh
from mdp.ranking.node import Node
from mdp.search.by_hand import cut_near
from mdp.search.front import Pricing, Weights, front_row, with_price
from mdp.search.parts import decomposition_of, make_parts, notes_of_search
from mdp.search.polish import refine_planes
from mdp.search.problem import Problem
from mdp.sweep.rays import nearest_faces, triangle_tree
from mdp.zone import Volume, Zones
from profiles.profile import Profile

WORTH = 0.7  # share of the faces above which a copy saves too little
# Tolerance of the simplification, and limit of the copy's distance from the model, in layers: successive removals of faces move
# the surface by more than the tolerance. The first pair is for copies with at most half as many faces as a model may have.
COARSEST, *FINER = (0.5, 1.5), (0.25, 1.0), (0.125, 1.0), (0.0625, 1.0)


def coarse_copy(mesh: Mesh, profile: Profile, zones: Zones, on_phase: Callable[[str], None] = lambda text: None) -> Mesh | None:
    """A simplified copy to search, whose surface lies within one and a half layers of every vertex; None if the mesh itself is to
    be searched: it has few faces, few can be removed, single faces are marked, or the paper's terms apply.
    """
    search, layer_mm = profile.search.effective, profile.process.layer_height_mm
    fine = 0 < search.simplify_faces < len(mesh.faces) and search.method == "best" and search.objective == "scar"
    marked = any(not isinstance(zone, Volume) for zone in (*zones.keep, *zones.no_seam, *zones.no_support, *zones.support))
    if not fine or marked:
        return None
    on_phase(f"simplifying {len(mesh.faces):,} faces for the search")
    for tolerance, off in (COARSEST, *FINER):
        copy = simplify(mesh, tolerance * layer_mm)
        if len(copy.faces) >= WORTH * len(mesh.faces):
            break
        few = tolerance == COARSEST[0] and len(copy.faces) < search.simplify_faces / 2
        if not few and nearest_faces(triangle_tree(copy), mesh.vertices, off * layer_mm)[0].max() < off * layer_mm:
            return copy
    return None


def cut_as_copy(problem: Problem, copy: Decomposition, price: Pricing | None) -> Decomposition | None:
    """Cut a problem's mesh, from the start node of its search, by the planes chosen for its coarse copy, or by neighbouring
    planes where bumps missing in the copy make them infeasible; then refine the planes on the mesh itself. None if there are no
    such planes. The row of the start node is measured again as well.
    """
    began, rows, start = perf_counter(), list(copy.front), problem.start
    place = next(place for place, row in enumerate(rows) if row.chosen)
    node = start
    for plane in rows[place].planes[len(start.cuts) :]:
        child = cut_near(problem, node, plane)
        if child is None:
            return None
        node = child
    node = refine_planes(problem, node)
    parts, timed = make_parts(problem, node), rows[place].time_s is not None
    rows[place] = _measured(rows[place], node)
    if price is not None and timed:
        rows[place] = with_price(rows[place], price(parts))
    if place > 0 and len(rows[0].planes) == len(start.cuts):
        rows[0] = _measured(rows[0], start)
    for changed in {0, place}:
        rows[changed] = _with_total(rows[changed], copy.front[changed], Weights.of(problem.profile))
    searched_s = copy.search_s + perf_counter() - began
    fine = decomposition_of(problem, copy.name, parts, rows, notes_of_search(copy))
    evaluated = copy.candidates_evaluated
    return replace(fine, ranker=copy.ranker, rounds=copy.rounds, candidates_evaluated=evaluated, search_s=searched_s)


def _measured(row: FrontRow, node: Node) -> FrontRow:
    """A row with the planes and costs of a node; its time stays."""
    costs = front_row(node)
    return replace(costs, chosen=row.chosen, reason=row.reason, time_s=row.time_s, filament_mm=row.filament_mm, flaw=row.flaw)


def _with_total(row: FrontRow, before: FrontRow, weights: Weights) -> FrontRow:
    """A measured row with its total, which differs from that before by cost, time and filament."""
    if before.total_mm2 is None:
        return row
    dearer_mm2 = row.cost_mm2 - before.cost_mm2 + (weights.of_row(row) or 0.0) - (weights.of_row(before) or 0.0)
    return replace(row, total_mm2=before.total_mm2 + dearer_mm2)
