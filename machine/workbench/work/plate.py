"""Plate: the print of all models on the plate, and the places where the others are drawn."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from itertools import product
from pathlib import Path

import numpy as np

from machine.pipeline.choice import as_turned
from machine.pipeline.plate import on_one_plate, places_of
from machine.planning.fit import Place, standing_at
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.bench.model import mesh_blocks
from machine.workbench.work.cutting import cut_bench, in_one_piece, turned_mesh
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition
from mdp.kernels.workers import Tell
from mdp.mesh import Mesh, together
from mdp.pedestal import on_pedestal
from profiles.errors import PlanError, UserError
from profiles.machine import Table
from profiles.profile import Profile
from profiles.settings.support import MIDDLE

APART_MM = 10.0  # between models beside the plate
MOST_DRAWN = 2_000_000  # faces of the other models together; those beyond are drawn as boxes


def plated(bench: Bench) -> tuple[Decomposition, Profile]:
    """The parts of all models on the plate, as for `export MODEL:COPIES ...`, each cut by its plan, and the profile to print them
    with. Raises UserError."""
    models, settings = list[Decomposition](), {}
    for each in bench.plate:
        with naming_model(each if bench.beside else None):
            cut = cut_bench(each, plan_of_bench(each))
        models += [cut] * each.copies
        settings[cut] = each.profile.parts
    if not bench.beside:
        return on_one_plate(models, as_turned(bench.profile, bench.turned))
    return on_one_plate(models, bench.profile.of_all_parts, settings)


@contextmanager
def naming_model(bench: Bench | None) -> Iterator[None]:
    """Add the name of a bench's model to errors about it."""
    try:
        yield
    except UserError as error:
        if bench is not None and bench.model is not None:
            error.args = (f"{bench.model.name}: {error}",)
        raise


@dataclass(frozen=True, eq=False)
class Plated:
    """The models of a plate. copies_mm: x, y of the centres of the bench's model and its copies relative to their place, the
    nearest first; problem: why they do not all fit or cannot be cut, "": they do; others, others_key: file of the other models'
    triangles, in the format of `mesh_blocks`, from the place of all, and their key, "" if there are none; other_boxes: the number
    of each of them among the other models, and two corners of the box around it, mm from the place of all."""

    copies_mm: tuple[Place, ...] = (MIDDLE,)
    problem: str = ""
    others: Path | None = None
    others_key: str = ""
    other_boxes: tuple[tuple[int, list[list[float]]], ...] = ()


def put_on_plate(tell: Tell, bench: Bench, drawn: Path) -> Plated:
    """The places of all models on the plate. Where they do not fit, all but the bench's own stand beside the plate. drawn: the
    file for the other models' triangles."""
    place_mm, problem = bench.profile.process.place_mm, ""

    def model_of(each: Bench) -> Decomposition:
        nonlocal problem
        assert each.model is not None
        try:
            with naming_model(each if bench.beside else None):
                if each.parts > 1:
                    return cut_bench(each, plan_of_bench(each))
                mesh = on_pedestal(turned_mesh(each), each.profile.search.pedestal_mm)
        except UserError as error:
            problem, mesh = problem or f"{error}", turned_mesh(each)
        return in_one_piece(each.model.name, mesh, each.profile.machine)

    plate, models = bench.plate, list[Decomposition]()
    for each in plate:
        models += [model_of(each)] * each.copies
    first = sum(each.copies for each in plate[: bench.number])
    own = range(first, first + bench.copies)
    rest = [k for k in range(len(models)) if k not in own]
    try:
        places, arranged = places_of(models, bench.profile)
        models = list(arranged.models)
    except PlanError as error:
        problem = problem or f"{error}"
    if problem:
        middles = [model.mesh.bounds_mm[:, :2].mean(axis=0).tolist() for model in models]
        models = [standing_at(model, (-x, -y)) for model, (x, y) in zip(models, middles, strict=True)]
        order = [*own, *rest]
        beside = _beside_plate([models[k].mesh for k in order], bench.profile.machine.table, place_mm)
        places = [place for _, place in sorted(zip(order, beside, strict=True))]
    shifts = [(at_x - place_mm[0], at_y - place_mm[1]) for at_x, at_y in places]
    meshes = [standing_at(models[k], shifts[k]).mesh for k in rest]
    numbers = [number for number, other in enumerate(bench.beside) for _ in range(other.copies)]
    content = b"".join(mesh_blocks(_drawable(meshes))) if meshes else b""
    drawn.write_bytes(content)
    return Plated(
        tuple(shifts[k] for k in own),
        problem,
        drawn,
        sha256(content).hexdigest()[:16] if meshes else "",
        tuple((number, np.round(mesh.bounds_mm, 2).tolist()) for number, mesh in zip(numbers, meshes, strict=True)),
    )


def _beside_plate(meshes: Sequence[Mesh], table: Table, place_mm: Place) -> list[Place]:
    """Places in columns to the right of the plate; the first model, which the user turns, is at its place."""
    right_mm, half_mm = (0.5 * size for size in table.size_mm or (2.0 * table.radius_mm,) * 2)
    places, left_mm, front_mm, widest_mm = [place_mm], right_mm + APART_MM, -half_mm, 0.0
    for mesh in meshes[1:]:
        width, depth, _ = np.ptp(mesh.bounds_mm, axis=0).tolist()
        if front_mm > -half_mm and front_mm + depth > half_mm:
            left_mm, front_mm, widest_mm = left_mm + widest_mm + APART_MM, -half_mm, 0.0
        places.append((left_mm + 0.5 * width, front_mm + 0.5 * depth))
        front_mm, widest_mm = front_mm + depth + APART_MM, max(widest_mm, width)
    return places


def _drawable(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one; boxes in place of those for which there are too many faces."""
    drawn, faces = [], 0
    for mesh in meshes:
        faces += len(mesh.faces)
        drawn.append(mesh if faces <= MOST_DRAWN else convex_hull(np.array(list(product(*mesh.bounds_mm.T)))))
    return together(drawn)
