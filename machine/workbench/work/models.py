"""Models: tasks that read a model, compute its placement and stable orientations, and mark its faces."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from machine.pipeline import compilers
from machine.pipeline.embedded_profile import has_settings
from machine.pipeline.project import STANDING
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.changes import workpiece_mesh
from machine.workbench.bench.model import Model, mesh_blocks
from machine.workbench.bench.values import vector_of
from machine.workbench.work.cutting import out_of_reach, turned_mesh
from mdp.directions.orientation import in_words, resting_facets, side_in_words
from mdp.kernels.workers import Tell
from mdp.overhang import Mask, risky_upright
from mdp.pedestal import on_pedestal, pedestal_under
from mdp.read import SizeError
from mdp.read import read_model as read_model_file
from mdp.search.orient import distinct_orientations
from mdp.search.parts import one_piece
from mdp.search.plan_file import ZONE_KINDS
from mdp.zone import Zone, Zones
from profiles.errors import MeshError
from profiles.frozen import Vector
from profiles.profile import Profile

FACET_DIGITS = 4  # digits after the point of mm


@dataclass(frozen=True, eq=False)
class Resting:
    """An orientation in which the model rests on a facet of its convex hull without falling over.

    rotation: rows of the (3, 3) rotation matrix; words: description for the user; overhang_mm2: overhanging area in this
    orientation; height_mm: height of the model in it.
    """

    rotation: tuple[tuple[float, ...], ...]
    words: str
    overhang_mm2: float
    height_mm: float


@dataclass(frozen=True)
class Unscaled:
    """A model that was not read because its size suggests another unit than mm; see mdp.read.SizeError.

    sentence: what was found; question: question for the user; units: the scale of each unit in question.
    """

    sentence: str
    question: str
    units: dict[str, float]


def read_model(
    tell: Tell, path: Path, name: str, profile: Profile, mesh_file: Path, plate: int | None = None
) -> Model | Unscaled:
    """Read a model file for the workbench. name: name of the file for the user. Raises UserError like the command line."""
    try:
        read = read_model_file(path, profile.process.scale, profile.process.rotate_deg, plate)
    except SizeError as error:
        sentence, question = (text.replace(str(path), name) for text in (f"{error}", error.question))
        return Unscaled(sentence, question, error.units)
    except MeshError as error:
        raise MeshError(f"{error}".replace(str(path), name)) from None
    return Model.stored(name, path, read, mesh_file, plate, has_settings(path))


def rank_resting(tell: Tell, model: Model, profile: Profile) -> tuple[Resting, ...]:
    """How a model stands as it is read, then the other orientations in which it rests, the most promising first."""
    compilers.wait_for(compilers.JUDGE)
    mesh = model.mesh()
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg)
    as_read = Resting(STANDING, "as in the file", float(mesh.areas_mm2[risky].sum()), float(np.ptp(mesh.bounds_mm[:, 2])))
    others = (
        Resting(
            tuple(tuple(float(value) for value in row) for row in orientation.rotation),
            side_in_words(orientation) or in_words(orientation),
            orientation.risky_mm2,
            orientation.height_mm,
        )
        for orientation in distinct_orientations(mesh, profile, for_person=True)
    )
    return as_read, *others


def rest_facets(tell: Tell, model: Model) -> bytes:
    """Facets of a model's hull that it can rest on, as JSON in its own frame: `normal`, `corners` (nine numbers a triangle)."""
    facets = [
        {"normal": normal.tolist(), "corners": np.round(corners, FACET_DIGITS).ravel().tolist()}
        for normal, corners in resting_facets(model.mesh())
    ]
    return json.dumps(facets).encode()


def mark(tell: Tell, bench: Bench, marking: Callable[[Bench], Zones]) -> Zones:
    """The zones of a bench after a change by the user."""
    return marking(bench)


def mark_faces(tell: Tell, bench: Bench) -> bytes:
    """(m,) bit mask per face of the kinds of zones, other than boxes, that contain it."""
    return bytes(np.packbits(named_faces(bench), axis=0, bitorder="little")[0])


def named_faces(bench: Bench) -> Mask:
    """(kinds, m) faces of the model in zones other than boxes."""
    mesh = workpiece_mesh(bench)
    rows = np.zeros((len(ZONE_KINDS), len(mesh.faces)), dtype=np.bool_)
    for row, kind in zip(rows, ZONE_KINDS, strict=True):
        for zone in getattr(bench.zones, kind):
            if not isinstance(zone, Zone):
                row |= zone.faces(mesh)
    return rows


@dataclass(frozen=True, eq=False)
class Standing:
    """Placement of a model. size_mm: along the plate's axes, without the pedestal; overhang_mm2: area that overhangs too far, off
    the plate; problem: why the machine cannot reach it in one piece, in the words of `export`, "" if it can; pedestal: in the
    format of `mesh_blocks`, b"": there is none; refusal: why a wanted pedestal is impossible."""

    size_mm: Vector
    overhang_mm2: float
    problem: str
    pedestal: bytes = b""
    refusal: str = ""


def stand(tell: Tell, bench: Bench) -> Standing:
    """The placement of the model on the bench."""
    mesh, profile, pedestal, refusal = turned_mesh(bench), bench.profile, b"", ""
    size_mm = vector_of(np.ptp(mesh.bounds_mm, axis=0))
    height_mm = profile.search.pedestal_mm
    if height_mm > 0.0:
        try:
            pedestal = b"".join(mesh_blocks(pedestal_under(mesh, height_mm)))
            mesh = on_pedestal(mesh, height_mm)
        except MeshError as error:
            pedestal, refusal = b"", f"{error}"
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg)
    problem = out_of_reach((one_piece(mesh, profile.machine),), profile)
    return Standing(size_mm, float(mesh.areas_mm2[risky].sum()), problem, pedestal, refusal)
