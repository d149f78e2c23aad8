"""Sheets of alternatives for the book of choices (tools/campaigns/choices.jsonl): ways to orient and cut a model, for blind
judging.

`python tools/campaigns/offer_parts.py LIST.csv FOLDER` reads lines of id, file, class, source, size_mm. For each model, scaled to
a longest side of size_mm, it collects one piece in its best orientations and rows of several fronts, at the standard weights and
with more expensive seams, in two orientations; if these are too few, also with cheaper seams and in more orientations. Each sheet
shows four to seven of them, without figures and in random order: every alternative from its best side and from below, with faces
that need support in red. FOLDER/offers.jsonl has them as plans. Models already in it are skipped, so that a run can resume.
"""

import argparse
import csv
import random
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

from machine.pipeline.choice import pricing
from machine.pipeline.pictures import FLOOR, best_view, floor_of, parts_apart, write_png, write_text
from machine.pipeline.raster import Image, camera, draw
from machine.view.parts import part_colours, residual_faces
from mdp.cost.cost import needing_upright
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import resting_orientations, set_on_plate
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.read import read_mesh
from mdp.search.orient import forecast_orientations, orient_and_decompose
from mdp.search.plan_file import PlanFile, PlannedPart, mesh_sha256
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load
from tools.campaigns.harness import append_line, read_lines
from tools.campaigns.judge_parts import scaled

MOST, LEAST, MOST_PARTS = 7, 4, 5
WHOLE = 3  # orientations in which one piece is offered
FURTHER = 4  # orientations in which cuts are sought if there are few alternatives
SAME = cos(radians(15.0))  # between the directions of equal orientations and planes
SAME_MM = 0.04  # between the heights of equal planes, relative to the longest side
SEAMS: tuple[dict[str, float], ...] = ({}, {"seam_mm": 10.0})
CHEAP = ({"seam_mm": 0.1, "cut_mm2": 0.0, "feature_mm2": 0.0},)  # if the others find too few
PIXELS = 400


@dataclass(frozen=True, eq=False)
class Offer:
    """An alternative: (3, 3) rotation of the model, and its planes in the order of the cuts."""

    rotation: Floats
    planes: tuple[Plane, ...]
    today: bool = False

    def is_like(self, other: "Offer", size_mm: float) -> bool:
        """Whether two alternatives look the same."""
        if len(self.planes) != len(other.planes) or self.rotation[2] @ other.rotation[2] < SAME:
            return False
        turn, left = other.rotation @ self.rotation.T, list(other.planes)
        for plane in self.planes:
            near = [k for k in left if _near(plane, k, turn, size_mm)]
            if not near:
                return False
            left.remove(near[0])
        return True


def _near(plane: Plane, other: Plane, turn: Floats, size_mm: float) -> bool:
    along = float(turn @ plane.normal @ other.normal)
    return along > SAME and abs(plane.offset_mm - other.offset_mm) < SAME_MM * size_mm


def main() -> None:
    parser = argparse.ArgumentParser(description="sheets of alternatives for the book of choices")
    parser.add_argument("models", type=Path)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    lines, profile = options.folder / "offers.jsonl", load()
    known = {offered["sheet"] for offered in read_lines(lines)}
    with options.models.open() as table:
        wanted = [row for row in csv.DictReader(table) if sheet_name(row) not in known]
    for row in wanted:
        try:
            offered = sheet(row, options.folder, profile)
        except UserError as error:
            print(f"{sheet_name(row)}: {error}", flush=True)
            continue
        append_line(lines, offered)
        print(f"{offered['sheet']}: {len(offered['alternatives'])} alternatives", flush=True)


def sheet_name(row: dict[str, str]) -> str:
    """The name of a model's sheet."""
    return f"{row['id']}_{float(row['size_mm']):g}"


def sheet(row: dict[str, str], folder: Path, profile: Profile) -> dict[str, Any]:
    """Draw a model's sheet; returns its alternatives as plans, by the letters on the sheet."""
    mesh = scaled(read_mesh(Path(row["file"]), 1.0, (0.0, 0.0, 0.0))[0], float(row["size_mm"]))
    mesh = set_on_plate(mesh, np.eye(3))
    offers, sha = offers_of(mesh, profile), mesh_sha256(mesh)
    random.Random(sha).shuffle(offers)
    cut = [decomposed(mesh, offer, profile) for offer in offers]
    write_png(folder / f"{sheet_name(row)}.png", picture(sheet_name(row), cut, profile))
    alternatives = {letter: as_plan(offer) for letter, offer in zip("ABCDEFG", offers, strict=False)}
    place = {key: row[key] for key in ("id", "class", "source")}
    return {"sheet": sheet_name(row), **place, "size_mm": float(row["size_mm"]), "sha256": sha, "alternatives": alternatives}


def offers_of(mesh: Mesh, profile: Profile) -> list[Offer]:
    """Today's choice, one piece in the best and in the original orientation, and the most different rows of fronts."""
    size_mm, price = float(np.ptp(mesh.vertices, axis=0).max()), pricing(profile)
    search = partial(decompose, name="", profile=profile, request=SearchRequest(price=price))
    oriented = orient_and_decompose(mesh, profile, pricing, search)
    taken = np.eye(3) if oriented.orientation is None else oriented.orientation.rotation
    forecasts = sorted(forecast_orientations(mesh, profile, pricing), key=lambda forecast: forecast.whole_mm2)
    printable = [forecast.orientation.rotation for forecast in forecasts if np.isfinite(forecast.whole_mm2)]
    whole = distinct([], [Offer(turn, ()) for turn in (taken, *printable[:1], np.eye(3), *printable)], size_mm, WHOLE)
    offers = [Offer(taken, tuple(part.base for part in reversed(oriented.decomposition.parts[1:])), True)]
    offers += distinct(offers, whole, size_mm, WHOLE)
    resting = [Offer(turn.rotation, ()) for turn in resting_orientations(mesh, profile.process.self_supporting_angle_deg)]
    for seams, poses in ((SEAMS, whole[:2]), (CHEAP, whole), (CHEAP, resting[:FURTHER])):
        rows = [cut_rows(mesh, pose.rotation, profile, seams) for pose in poses]
        for several in zip_longest(*rows):  # the first of each list, then the second of each
            offers += distinct(offers, [offer for offer in several if offer is not None], size_mm, MOST - len(offers))
        if len(offers) >= LEAST:
            break
    return offers + distinct(offers, resting, size_mm, LEAST - len(offers))


def distinct(known: Sequence[Offer], offers: Sequence[Offer], size_mm: float, most: int) -> list[Offer]:
    """At most `most` offers that differ from all before them."""
    new: list[Offer] = []
    for offer in offers:
        if len(new) < most and not any(offer.is_like(other, size_mm) for other in (*known, *new)):
            new.append(offer)
    return new


def cut_rows(mesh: Mesh, rotation: Floats, profile: Profile, settings: Sequence[dict[str, float]]) -> list[Offer]:
    """Rows of the fronts of a rotated model, one front for each of the settings, those of two parts first."""
    turned, rows = set_on_plate(mesh, rotation), list[FrontRow]()
    narrow = {"beam_width": 1, "directions": profile.search.directions // 2}
    for seams in settings:
        own = profile.model_copy(update={"search": profile.search.model_copy(update=narrow | seams)})
        rows += [row for row in decompose(turned, "", own).front if 1 < row.parts <= MOST_PARTS]
    return [Offer(rotation, row.planes) for row in sorted(rows, key=lambda row: row.parts)]


def decomposed(mesh: Mesh, offer: Offer, profile: Profile) -> Decomposition:
    """The decomposition of an offered alternative."""
    plan = PlanFile("", parts=tuple(map(PlannedPart.of, reversed(offer.planes))))
    return cut_by_plan(set_on_plate(mesh, offer.rotation), "", profile, SearchRequest(plan=plan))


def as_plan(offer: Offer) -> dict[str, Any]:
    """The record of an alternative."""
    planes = []
    for plane in offer.planes:
        limbs = {} if plane.limbs_mm is None else {"limbs_mm": plane.limbs_mm.tolist()}
        planes.append({"normal": plane.normal.tolist(), "offset_mm": float(plane.offset_mm), **limbs})
    return {"orientation": offer.rotation.tolist(), "planes": planes, "today": offer.today}


def picture(name: str, cut: Sequence[Decomposition], profile: Profile) -> Image:
    """The alternatives in two columns, each with its letter."""
    frames = [frame(letter, one, profile) for letter, one in zip("ABCDEFG", cut, strict=False)]
    if len(frames) % 2:
        frames.append(np.full_like(frames[0], 255))
    rows = [np.concatenate(frames[place : place + 2], axis=1) for place in range(0, len(frames), 2)]
    title = write_text(np.full((40, rows[0].shape[1], 3), 255, np.uint8), name, (10, 30), 26, 90)
    return np.concatenate([title, *rows], axis=0)


def frame(letter: str, one: Decomposition, profile: Profile) -> Image:
    """An alternative from its best side and from below."""
    meshes, colours = parts_apart(one.parts), part_colours(len(one.parts))
    reds = [residual_faces(part, profile) for part in one.parts]
    view = best_view(one.mesh, needing_upright(one.mesh, profile))
    floor, low = floor_of(one.mesh), camera(view[2] * np.array([1.0, 1.0, 0.0]) - np.array([0.0, 0.0, 0.7]))
    above = draw([floor, *meshes], [FLOOR, *colours], reds=[None, *reds], axes=view, size=(PIXELS, PIXELS))
    below = draw(meshes, colours, reds=reds, axes=low, size=(PIXELS, PIXELS))
    image = np.concatenate([above, below], axis=1)
    image[:2], image[:, :2] = 180, 180
    text = f"{letter}: {'one piece' if len(one.parts) == 1 else f'{len(one.parts)} parts'}"
    return write_text(write_text(image, text, (10, 30), 26, 30), "from below", (PIXELS + 10, 30), 16, 130)


if __name__ == "__main__":
    main()
