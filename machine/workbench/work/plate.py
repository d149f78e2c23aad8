"""Plate: the print of all models on the plate, and the places where the others are drawn.

The other models are oriented and cut as `export` does it without a plan. Their parts stay in a file, by the keys of the models,
until the profile changes in a way that may lead to other parts.
"""

import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import product
from pathlib import Path

import numpy as np

from machine.notices import FrontEnd, Report, notices_to
from machine.pipeline.choice import as_turned
from machine.pipeline.pipeline import decompose_alone
from machine.pipeline.plate import naming, on_one_plate, places_of
from machine.pipeline.requests import ModelRequest
from machine.planning.fit import Place, standing_at
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.bench.model import Model, mesh_blocks
from machine.workbench.work.cutting import cut_bench, in_one_piece, turned_mesh
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition
from mdp.kernels.workers import Tell
from mdp.mesh import Mesh, together
from mdp.model_file import DEMO
from mdp.pedestal import on_pedestal
from profiles.errors import MeshError, PlanError, UserError
from profiles.files import write_whole
from profiles.machine import Table
from profiles.part_settings import PartSettings
from profiles.profile import Profile
from profiles.settings.support import MIDDLE

APART_MM = 10.0  # between models beside the plate
MOST_DRAWN = 2_000_000  # faces of the other models together; those beyond are drawn as boxes
Cut = tuple[Decomposition, list[PartSettings]]  # another model, and the settings of single parts in the plan of a demo


def plated(bench: Bench, others: Path, report: Callable[[str], None]) -> tuple[Decomposition, Profile]:
    """The parts of all models on the plate, as for `export MODEL:COPIES ...`, and the profile to print them with. others: the
    file of the other models' parts, which receives those that it lacks."""
    cut = cut_bench(bench, plan_of_bench(bench))
    if not bench.beside:
        return on_one_plate([cut] * bench.copies, as_turned(bench.profile, bench.turned))
    profile, known = bench.profile.of_all_parts, known_cuts(others)
    for model, _ in bench.beside:
        if model.key not in known:
            known[model.key] = _cut(model, profile, report)
            write_whole(others, pickle.dumps(known))
    models, settings = [cut] * bench.copies, {cut: bench.profile.parts}
    for model, copies in bench.beside:
        decomposition, own = known[model.key]
        models += [decomposition] * copies
        settings[decomposition] = own
    return on_one_plate(models, profile, settings)


def known_cuts(others: Path) -> dict[str, Cut]:
    """The parts of other models that are in the file, by the keys of the models."""
    if not others.exists():
        return {}
    known: dict[str, Cut] = pickle.loads(others.read_bytes())  # written by this program into its own folder
    return known


def _cut(model: Model, profile: Profile, report: Callable[[str], None]) -> Cut:
    """A model in its parts, as `export` searches them. Raises UserError."""

    @contextmanager
    def progress() -> Iterator[Report]:
        yield lambda text, share=None: report(f"{model.name}: {text}")

    report(f"finding the parts of {model.name}")
    request = ModelRequest(model.name if model.name.startswith(DEMO) else str(model.path), profile)
    with naming(model.name), notices_to(FrontEnd(lambda notice: None, progress)):
        try:
            found = decompose_alone(request, to_build=True)
        except MeshError as error:
            raise MeshError(f"{error}".replace(str(model.path), model.name)) from None
    return replace(found.decomposition, name=model.name), found.profile.parts


@dataclass(frozen=True, eq=False)
class Plated:
    """The models of a plate. copies_mm: x, y of the centres of the bench's model and its copies relative to their place, the
    nearest first; problem: why they do not all fit, "": they do; is_sure: whether all are cut as they are printed, so that the
    problem is that of slicing; others, others_key: file of the other models' triangles, in the format of `mesh_blocks`, from the
    place of all, and their key, "" if there are none."""

    copies_mm: tuple[Place, ...] = (MIDDLE,)
    problem: str = ""
    is_sure: bool = True
    others: Path | None = None
    others_key: str = ""


def put_on_plate(tell: Tell, bench: Bench, others: Path, drawn: Path) -> Plated:
    """The places of all models on the plate. Another model that is not cut yet stands as it is read, in one piece. Where they do
    not fit, all but the first stand beside the plate. drawn: the file for the other models' triangles."""
    assert bench.model is not None
    place_mm, machine, height_mm, problem = (
        bench.profile.process.place_mm,
        bench.profile.machine,
        bench.profile.search.pedestal_mm,
        "",
    )

    def uncut(name: str, mesh: Mesh) -> Decomposition:
        nonlocal problem
        try:
            mesh = on_pedestal(mesh, height_mm)
        except MeshError as error:
            problem = problem or f"{error}"
        return in_one_piece(name, mesh, machine)

    known = known_cuts(others) if bench.beside else {}
    try:
        cut = cut_bench(bench, plan_of_bench(bench)) if bench.parts > 1 else uncut(bench.model.name, turned_mesh(bench))
    except UserError as error:
        cut, problem = uncut(bench.model.name, turned_mesh(bench)), f"{error}"
    models = [cut] * bench.copies
    for model, copies in bench.beside:
        models += [known[model.key][0] if model.key in known else uncut(model.name, model.mesh())] * copies
    try:
        places, plate = places_of(models, bench.profile)
        models = list(plate.models)
    except PlanError as error:
        problem = problem or f"{error}"
    if problem:
        middles = [model.mesh.bounds_mm[:, :2].mean(axis=0).tolist() for model in models]
        models = [standing_at(model, (-x, -y)) for model, (x, y) in zip(models, middles, strict=True)]
        places = _beside_plate([model.mesh for model in models], machine.table, place_mm)
    shifts = [(at_x - place_mm[0], at_y - place_mm[1]) for at_x, at_y in places]
    meshes = [standing_at(models[k], shifts[k]).mesh for k in range(bench.copies, len(models))]
    content = b"".join(mesh_blocks(_drawable(meshes))) if meshes else b""
    drawn.write_bytes(content)
    is_sure = all(model.key in known for model, _ in bench.beside)
    return Plated(tuple(shifts[: bench.copies]), problem, is_sure, drawn, sha256(content).hexdigest()[:16] if meshes else "")


def _beside_plate(meshes: Sequence[Mesh], table: Table, place_mm: Place) -> list[Place]:
    """Places in columns to the right of the plate; the first model, which a hand turns, is at its place."""
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
