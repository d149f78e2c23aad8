"""Book of choices, tools/campaigns/choices.jsonl: alternatives that judges mark as best, acceptable or wrong, and cost weights
fitted to it.

`python tools/campaigns/fit_choices.py add LIST.csv OFFERS.jsonl VERDICTS.csv...` measures the alternatives of
tools/campaigns/offer_parts.py and adds them to the book; each line of a file of verdicts has a sheet, the letters of its best,
acceptable and wrong alternatives, and a reason. `fit` fits weights to all pairs that a judge marks differently, by the model
of Bradley and Terry (1952): the probability that one alternative is preferred is logistic in the difference of their costs,
relative to the model's surface. It reports how many pairs the weights of the profile (`--set KEY=VALUE`) and the fitted ones
order as the judges do, with cross-validation over tenths of the models' sources, and how the judges mark the profile's choice
on each sheet.
"""

import argparse
import csv
import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from machine.pipeline.choice import pricing
from mdp.cost.cost import weight_of_stairs
from mdp.cost.footing import BuildPlate
from mdp.directions.orientation import diameter_mm, set_on_plate
from mdp.directions.revolution import find_revolution
from mdp.joint import flaw_of
from mdp.mesh import Floats
from mdp.overhang import UP, Mask
from mdp.plane import Plane
from mdp.ranking.node import Node
from mdp.read import read_mesh
from mdp.search.by_hand import cut_by_hand
from mdp.search.front import front_row
from mdp.search.orient import NARROW, TURNED, UNSTEADY
from mdp.search.parts import make_parts
from mdp.search.plan_file import PlanFile, PlannedPart, mesh_sha256
from mdp.search.problem import SIZE_MM, Problem
from mdp.support_need.need import MADE_BY_A_CUT
from mdp.sweep.crossing import measure_rim
from mdp.sweep.limbs import limb_faces
from profiles.profile import Profile, load
from tools.campaigns.harness import read_lines
from tools.campaigns.judge_parts import scaled
from tools.campaigns.offer_parts import sheet_name

BOOK = Path(__file__).parent / "choices.jsonl"
MARKS = ("best", "acceptable", "wrong")
# Terms of an alternative's cost: mm², mm, seconds and metres; then numbers from 0 to 1, relative to the surface.
COSTS = ("support_mm2", "seam_mm", "hidden_seam_mm", "stairs_mm2", "cuts", "time_s", "filament_m")
SHARES = ("narrow", "unsteady", "turned", "axis_askew", "unsound")
NEVER = 1.0  # of the surface: never chosen by the search
RIDGE, ROUNDS, FOLDS = 1e-3, 3000, 10
DIGITS = 9  # of orientations and planes in the book


def main() -> None:
    parser = argparse.ArgumentParser(description="the book of choices")
    commands = parser.add_subparsers(dest="command", required=True)
    add = commands.add_parser("add")
    add.add_argument("models", type=Path)
    add.add_argument("offers", type=Path)
    add.add_argument("verdicts", type=Path, nargs="+")
    commands.add_parser("fit").add_argument("--set", action="append", default=[])
    options = parser.parse_args()
    if options.command == "fit":
        print(report(read_lines(BOOK), load(settings=options.set)))
    else:
        add_to_book(options.models, options.offers, options.verdicts, load())


def add_to_book(models: Path, offers: Path, verdicts: Sequence[Path], profile: Profile) -> None:
    """Measure the alternatives and add them to the book with their verdicts; known sheets get further verdicts."""
    with models.open() as table:
        files = {sheet_name(row): Path(row["file"]) for row in csv.DictReader(table)}
    known, said = {entry["sheet"]: entry for entry in read_lines(BOOK)}, [read_verdicts(file) for file in verdicts]
    for entry in read_lines(offers):
        name, own = entry["sheet"], [file[entry["sheet"]] for file in said if entry["sheet"] in file]
        for verdict in own:
            if set(verdict["marks"]) != set(entry["alternatives"]):
                letters = "".join(entry["alternatives"])
                raise SystemExit(f"{name}: every letter of {letters} needs one mark, not {verdict['marks']}")
        if name not in known and own:
            measure(entry, files[name], profile)
            known[name] = entry | {"verdicts": []}
        elif own and cuts_of(known[name]) != cuts_of(entry):
            raise SystemExit(f"{name}: the book has other alternatives by these letters")
        if name in known:
            judges = {verdict["judge"] for verdict in own}
            known[name]["verdicts"] = [verdict for verdict in known[name]["verdicts"] if verdict["judge"] not in judges] + own
    BOOK.write_text("".join(json.dumps(entry) + "\n" for _, entry in sorted(known.items())))


def cuts_of(entry: dict[str, Any]) -> list[int]:
    """Number of cuts of each alternative of a sheet."""
    return [len(alternative["planes"]) for alternative in entry["alternatives"].values()]


def read_verdicts(file: Path) -> dict[str, dict[str, Any]]:
    """Verdicts of a judge, who is named by the file, by sheet: the mark of each letter, and the reason."""
    said: dict[str, dict[str, Any]] = {}
    for row in csv.reader(file.read_text().splitlines()):
        if len(row) >= 4 and row[0].strip() != "sheet":
            sheet = row[0].strip().removesuffix(".png")
            cells = zip(MARKS, row[1:4], strict=True)
            marked = [(letter, mark) for mark, cell in cells for letter in cell.upper() if letter.isalpha()]
            if len(dict(marked)) < len(marked):
                raise SystemExit(f"{file}: {sheet}: a letter has two marks")
            said[sheet] = {"judge": file.stem, "marks": dict(marked), "reason": ",".join(row[4:]).strip()}
    return said


def measure(entry: dict[str, Any], file: Path, profile: Profile) -> None:
    """Add the costs of its alternatives to an entry."""
    mesh = set_on_plate(scaled(read_mesh(file, 1.0, (0.0, 0.0, 0.0))[0], entry["size_mm"]), np.eye(3))
    if mesh_sha256(mesh) != entry["sha256"]:
        raise SystemExit(f"{entry['sheet']}: {file} is not the model that was offered")
    entry["surface_mm2"], entry["diameter_mm"] = round(float(mesh.areas_mm2.sum()), 3), round(diameter_mm(mesh), 3)
    problem_of = cache(lambda turn: Problem(set_on_plate(mesh, np.array(turn)), profile))
    for alternative in entry["alternatives"].values():
        alternative["figures"] = figures(alternative, profile, problem_of)
        alternative["orientation"] = np.round(alternative["orientation"], DIGITS).tolist()
        for plane in alternative["planes"]:
            plane |= {key: np.round(value, DIGITS).tolist() for key, value in plane.items()}
    print(entry["sheet"], flush=True)


def figures(alternative: dict[str, Any], profile: Profile, problem_of: Callable[..., Problem]) -> dict[str, float]:
    """Terms of an alternative's cost. problem_of: the model's problem by its rotation."""
    turn = alternative["orientation"]
    problem = problem_of(tuple(map(tuple, turn)))
    node = cut_by_hand(problem, PlanFile("", parts=tuple(PlannedPart.of(plane_of(p)) for p in reversed(alternative["planes"]))))
    row, parts, of_file = front_row(node), make_parts(problem, node), turn[2][2] > 1.0 - 1e-6
    price = pricing(profile)(parts) or (nan, nan)
    seen_mm, hidden_mm = seams_by_sight(node, profile.search.hidden_seam_share)
    revolution = find_revolution(problem.mesh)
    footing = BuildPlate.under(problem.mesh, profile).footing(np.eye(3))
    askew = revolution is not None and not revolution.is_square_to(UP)
    scars_mm2, stairs_mm2 = sum(cut.cut_cost.seam_mm2 for cut in node.cuts), row.stairs_mm2 / weight_of_stairs(profile)
    support_mm2 = row.cost_mm2 - scars_mm2 - row.stairs_mm2
    costs = (support_mm2, seen_mm, hidden_mm, stairs_mm2, len(node.cuts), price[0], price[1] / 1000.0)
    shares = (footing.narrow, footing.unsteady, not of_file, askew, bool(flaw_of(problem.mesh, parts, profile)))
    return {name: round(float(value), 3) for name, value in zip((*COSTS, *SHARES), (*costs, *shares), strict=True)}


def plane_of(known: dict[str, Any]) -> Plane:
    """A plane from its record."""
    limbs_mm = np.array(known["limbs_mm"]) if "limbs_mm" in known else None
    return Plane(np.array(known["normal"]), known["offset_mm"], limbs_mm)


def seams_by_sight(node: Node, hidden_share: float) -> tuple[float, float]:
    """Lengths of the visible and the hidden seams of a node's cuts, mm; half hidden counts half in both. hidden_share: weight of
    a hidden mm."""
    weights, seen_mm, hidden_mm = node.places.by_source, 0.0, 0.0
    for step, before in _cuts(node):
        sources, base = before.piece.sources, step.base
        in_sight = np.clip((weights[sources] - hidden_share) / (1.0 - hidden_share), 0.0, 1.0)
        seen = np.where(sources == MADE_BY_A_CUT, 0.0, in_sight)
        cut: Mask = np.ones(len(sources), np.bool_) if base.limbs_mm is None else limb_faces(before.remainder, base)
        rim = measure_rim(before.remainder.mesh, np.where(cut, seen, 0.0), base, 0.0)
        seen_mm, hidden_mm = seen_mm + rim.weighted_mm, hidden_mm + max(step.seams[-1].length_mm - rim.weighted_mm, 0.0)
    return seen_mm, hidden_mm


def _cuts(node: Node) -> Iterator[tuple[Node, Node]]:
    """The nodes after and before each cut."""
    step = node
    while step.parent is not None:
        yield step, step.parent
        step = step.parent


@dataclass(frozen=True, eq=False)
class Pairs:
    """Preferences of judges: (n, k) excess of the worse alternative's terms over the better one's; (n,) source of each model;
    (n,) whether all judges of its sheet agree."""

    differences: Floats
    sources: np.ndarray
    unanimous: Mask


def pairs_of(book: Sequence[dict[str, Any]]) -> Pairs:
    """Every pair of alternatives that a judge marks differently."""
    pairs = []
    for entry in book:
        values = {letter: _row(entry, one) for letter, one in entry["alternatives"].items()}
        ranks = [{letter: MARKS.index(mark) for letter, mark in verdict["marks"].items()} for verdict in entry["verdicts"]]
        for one, other in combinations(sorted(values), 2):
            signs = [int(np.sign(rank[one] - rank[other])) for rank in ranks]
            difference = values[one] - values[other]
            if np.isfinite(difference).all():
                pairs += [(sign * difference, entry["source"], set(signs) == {sign}) for sign in signs if sign != 0]
    return Pairs(*(np.array(column) for column in zip(*pairs, strict=True)))


def _row(entry: dict[str, Any], alternative: dict[str, Any]) -> Floats:
    """(k,) terms of an alternative, all relative to the model's surface."""
    known = alternative["figures"]
    costs = np.array([known[name] for name in COSTS]) / entry["surface_mm2"]
    costs[1:3] *= entry["diameter_mm"] / SIZE_MM  # seams
    return np.array([*costs, *(known[name] for name in SHARES)])


def weights_of(profile: Profile) -> Floats:
    """(k,) weights of a profile."""
    search = profile.search.effective
    seams = (search.seam_mm, search.seam_mm * search.hidden_seam_share)
    costs = (1.0, *seams, weight_of_stairs(profile), search.cut_mm2, search.second_mm2, search.metre_mm2)
    return np.array([*costs, NARROW, UNSTEADY, TURNED, NEVER, NEVER])


def fitted(differences: Floats) -> Floats:
    """(k,) non-negative weights of a logistic regression without a constant, by accelerated projected gradients (Beck and
    Teboulle 2009)."""
    scale = np.abs(differences).mean(axis=0) + 1e-12
    x = differences / scale
    step = 4.0 / np.linalg.eigvalsh(x.T @ x / len(x)).max()
    weights = ahead = np.zeros(x.shape[1])
    for k in range(ROUNDS):
        chance = 1.0 / (1.0 + np.exp(-np.clip(x @ ahead, -50.0, 50.0)))
        new = np.maximum(ahead - step * (x.T @ (chance - 1.0) / len(x) + RIDGE * ahead), 0.0)
        weights, ahead = new, new + k / (k + 3.0) * (new - weights)
    return weights / scale


def ordered(pairs: Pairs, weights: Floats) -> Mask:
    """(n,) whether weights order each pair as the judge does."""
    return np.greater(pairs.differences @ weights, 0.0)


def ordered_by_others(pairs: Pairs) -> Mask:
    """(n,) whether weights fitted to pairs of other sources order each pair as the judge does."""
    names, counts = np.unique(pairs.sources, return_counts=True)
    fold = {name: place % FOLDS for place, name in enumerate(names[np.argsort(-counts, kind="stable")])}
    of_fold, right = np.array([fold[name] for name in pairs.sources]), np.zeros(len(pairs.sources), np.bool_)
    for k in np.unique(of_fold):
        right[of_fold == k] = pairs.differences[of_fold == k] @ fitted(pairs.differences[of_fold != k]) > 0.0
    return right


def taken(entry: dict[str, Any], weights: Floats, least_saving: float) -> str:
    """The letter of a sheet's cheapest alternative by some weights; every cut is charged a fraction of the least cost in one
    piece."""
    costs = {letter: float(_row(entry, one) @ weights) for letter, one in entry["alternatives"].items()}
    costs = {letter: cost for letter, cost in costs.items() if np.isfinite(cost)}
    cuts = {letter: len(entry["alternatives"][letter]["planes"]) for letter in costs}
    charge = least_saving * min((cost for letter, cost in costs.items() if cuts[letter] == 0), default=0.0)
    return min(costs, key=lambda letter: costs[letter] + charge * cuts[letter])


def report(book: Sequence[dict[str, Any]], profile: Profile) -> str:
    """Agreement of a profile's weights and of the fitted ones with the book, and the fitted weights."""
    pairs, own = pairs_of(book), weights_of(profile)
    fit, lines = fitted(pairs.differences), [f"{len(book)} sheets, {len(pairs.sources)} pairs that a judge marks differently"]
    by_name = {"profile": ordered(pairs, own), "fitted": ordered(pairs, fit), "cross-validated": ordered_by_others(pairs)}
    for name, right in by_name.items():
        lines.append(f"{name}: {right.mean():.1%} ordered as the judges do, {right[pairs.unanimous].mean():.1%} where they agree")
    letters = [taken(entry, own, profile.search.least_saving) for entry in book]
    pairs_taken = zip(book, letters, strict=True)
    marks = Counter(verdict["marks"][letter] for entry, letter in pairs_taken for verdict in entry["verdicts"])
    lines.append("marks of what the profile takes: " + ", ".join(f"{marks[mark]} {mark}" for mark in MARKS))
    lines += [f"{name:>15} {now:8.3g} {new / fit[0]:8.3g}" for name, now, new in zip((*COSTS, *SHARES), own, fit, strict=True)]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
