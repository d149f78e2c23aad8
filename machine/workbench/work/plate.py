"""Plate: the print of all models on the plate, and the places where the others are drawn.

The other models are oriented and cut as `export` does it without a plan. Their parts stay in a file, by the keys of the models,
until the profile changes in a way that may lead to other parts.
"""

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
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
from machine.workbench.work.cutting import cut_bench, in_one_piece
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh, together
from mdp.model_file import DEMO
from mdp.pedestal import on_pedestal
from profiles.errors import MeshError
from profiles.files import write_whole
from profiles.part_settings import PartSettings
from profiles.profile import Profile

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


def places_on_plate(mesh: Mesh, bench: Bench, others: Path, drawn: Path) -> tuple[tuple[Place, ...], str]:
    """The places of the copies, and a key of the other models' triangles, which are then in the file `drawn`, from the place of
    all; "" without other models. mesh: that of the bench's model as it stands. Another model that is not cut yet stands as it is
    read, in one piece.

    Raises PlanError for models that do not fit, MeshError for one that no pedestal carries.
    """
    assert bench.model is not None
    (x, y), machine, height_mm = bench.profile.process.place_mm, bench.profile.machine, bench.profile.search.pedestal_mm

    cut = cut_bench(bench, plan_of_bench(bench)) if bench.parts > 1 else in_one_piece(bench.model.name, mesh, machine)
    models, known = [cut] * bench.copies, known_cuts(others) if bench.beside else {}
    for model, copies in bench.beside:
        lifted = on_pedestal(model.mesh(), height_mm)
        own = known[model.key][0] if model.key in known else in_one_piece(model.name, lifted, machine)
        models += [own] * copies
    places, plate = places_of(models, bench.profile)
    shifts = [(at_x - x, at_y - y) for at_x, at_y in places]
    meshes = [standing_at(plate.models[k], shifts[k]).mesh for k in range(bench.copies, len(models))]
    content = b"".join(mesh_blocks(_drawable(meshes))) if meshes else b""
    drawn.write_bytes(content)
    return tuple(shifts[: bench.copies]), sha256(content).hexdigest()[:16] if meshes else ""


def _drawable(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one; boxes in place of those for which there are too many faces."""
    drawn, faces = [], 0
    for mesh in meshes:
        faces += len(mesh.faces)
        drawn.append(mesh if faces <= MOST_DRAWN else convex_hull(np.array(list(product(*mesh.bounds_mm.T)))))
    return together(drawn)
