"""Pedestal: a prism under the model that lifts it, so that low, strongly tilted cuts clear the table."""

import manifold3d as m3
import numpy as np

from mdp.cut import mesh_of, run_faces, solid_of
from mdp.mesh import NO_COLOUR, Ints, Mesh
from mdp.overhang import PLATE_TOLERANCE_MM
from profiles.errors import MeshError

MARGIN_MM = 2.0  # margin of the pedestal around the model's feet
LEAST_RADIUS_MM = 5.0  # even under a model that stands on a point
SEGMENTS = 64  # in a full circle: a corner of MARGIN_MM is round to 0.0024 mm


def on_pedestal(mesh: Mesh, height_mm: float) -> Mesh:
    """The mesh raised by a height, on a pedestal whose outline is that of its feet, grown by 2 mm.

    Several feet stand on one pedestal, the hull of their outlines. The model's first 0.3 mm, which would otherwise stand on the
    build plate, are sunk into the pedestal, so it also holds a model that touches the plate in one point. A height of 0 leaves
    the mesh unchanged. Raises MeshError if the result is not a solid.
    """
    if height_mm <= 0.0:
        return mesh
    solid = solid_of(mesh, apart=mesh.colours is not None)
    joined = solid.translate((0.0, 0.0, height_mm)) + _prism(solid, height_mm)
    if joined.status() != m3.Error.NoError:
        raise MeshError(f"the model cannot be put on a pedestal of {height_mm:g} mm ({joined.status().name})")
    lifted = mesh_of(joined)
    return lifted if mesh.colours is None else Mesh(lifted.vertices, lifted.faces, _colours(mesh.colours, solid, joined))


def pedestal_under(mesh: Mesh, height_mm: float) -> Mesh:
    """The pedestal alone, including the 0.3 mm into which the model is sunk."""
    return mesh_of(_prism(solid_of(mesh), height_mm))


def _prism(solid: m3.Manifold, height_mm: float) -> m3.Manifold:
    sunk_mm = min(PLATE_TOLERANCE_MM, 0.5 * float(solid.bounding_box()[5]))
    return m3.Manifold.extrude(_outline(solid, sunk_mm), height_mm + sunk_mm)


def _colours(colours: Ints, solid: m3.Manifold, joined: m3.Manifold) -> Ints:
    """(n,) colours of the faces of a solid after a union with another one, whose faces have none."""
    own = run_faces(solid)[0][0]
    pieces = [colours[faces] if origin == own else np.full(len(faces), NO_COLOUR) for origin, faces in run_faces(joined)]
    return np.concatenate(pieces).astype(np.int32)


def _outline(solid: m3.Manifold, height_mm: float) -> m3.CrossSection:
    """Outline of the pedestal: the solid's section at a small height, grown, in one piece."""
    feet = solid.slice(height_mm)
    loops = feet.to_polygons()
    if not loops:
        raise MeshError("the model cannot be put on a pedestal: it has no section just above the build plate")
    if len(feet.decompose()) > 1:
        feet = feet.hull()
    corners = np.concatenate(loops)
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    least = m3.CrossSection.circle(LEAST_RADIUS_MM, SEGMENTS).translate((float(middle[0]), float(middle[1])))
    grown = feet.offset(MARGIN_MM, m3.JoinType.Round, 2.0, SEGMENTS) + least
    return grown if len(grown.decompose()) == 1 else grown.hull()
