"""Faces in the page's scripts, run by Node: the tree that finds them, the circle of the brush, and the ruler on the plate."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from machine.view.page import TEMPLATE, bundle
from machine.workbench.web.server import OWN
from mdp.mesh import Mesh
from mdp.topology.components import vertex_components
from tests.machine.fake_page import NODE, needs_node
from tests.shapes import ball, box

pytestmark = needs_node


def run(script: Path, act: str, **given: Any) -> Any:
    """The value of a function body that can use the modules of a script and the given values by their names."""
    values = "".join(f"const {name} = {json.dumps(value)};" for name, value in given.items())
    page = "globalThis.document = { documentElement: { dataset: {} }, getElementById: () => null };"
    text = f"{page}{bundle(script)}\n{values} process.stdout.write(JSON.stringify((() => {{ {act} }})()));"
    assert NODE is not None
    done = subprocess.run([NODE, "-"], input=text, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def triangles(mesh: Mesh) -> dict[str, Any]:
    return {"corners": mesh.vertices[mesh.faces].ravel().tolist(), "faces": mesh.faces.ravel().tolist(), "count": len(mesh.faces)}


def nearest(mesh: Mesh, start: np.ndarray, along: np.ndarray) -> int:
    """The first face on a ray, from the barycentric coordinates of the point at which it meets the plane of each face."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    columns = np.stack([b - a, c - a, np.broadcast_to(-along, a.shape)], axis=2)
    u, v, far = np.linalg.solve(columns, (start - a)[:, :, None])[:, :, 0].T
    meets = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0)
    return int(np.where(meets, far, np.inf).argmin()) if meets.any() else -1


def test_the_face_under_a_ray_is_the_nearest_of_all_that_it_meets() -> None:
    mesh, rng = ball(10.0), np.random.default_rng(3)
    aims = rng.uniform((-12.0, -12.0, -2.0), (12.0, 12.0, 22.0), (200, 3))
    rays = [[[60.0, -40.0, 30.0], (aim - (60.0, -40.0, 30.0)).tolist()] for aim in aims]
    act = """const { faceMet } = modules["scene/face-tree"];
    return rays.map(([from, along]) => faceMet(model, from, along).face);"""
    met = run(OWN / "scene" / "face-tree.js", act, model=triangles(mesh), rays=rays)
    expected = [nearest(mesh, *map(np.array, ray)) for ray in rays]
    assert met == expected
    assert 20 < expected.count(-1) < 180


def test_the_brush_paints_connected_faces_in_its_circle_and_always_the_one_under_it() -> None:
    mesh = ball(10.0)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    face = int(np.argmax(middles[:, 0]))
    act = """const { facesAround } = modules["scene/face-tree"], faces = Uint32Array.from(model.faces);
    return radii.map((radius) => [...facesAround({ ...model, faces }, face, place, radius)]);"""
    given = {"model": triangles(mesh), "face": face, "place": middles[face].tolist(), "radii": [0.01, 4.0]}
    smallest, found = run(OWN / "scene" / "face-tree.js", act, **given)
    assert smallest == [face]
    assert sorted(found) == np.flatnonzero(np.linalg.norm(middles - middles[face], axis=1) <= 4.0).tolist()


def test_the_brush_does_not_reach_through_a_thin_wall() -> None:
    mesh = box(40.0, 1.0, 40.0).to_trimesh().subdivide().subdivide().subdivide()
    wall = Mesh(np.array(mesh.vertices), np.array(mesh.faces))
    middles = wall.vertices[wall.faces].mean(axis=1)
    face = int(np.argmin(np.linalg.norm(middles - (0.0, -0.5, 20.0), axis=1)))
    act = """const { facesAround } = modules["scene/face-tree"], faces = Uint32Array.from(model.faces);
    return [...facesAround({ ...model, faces }, face, place, 6)];"""
    found = run(OWN / "scene" / "face-tree.js", act, model=triangles(wall), face=face, place=middles[face].tolist())
    assert len(found) > 4
    assert set(wall.normals[found][:, 1].tolist()) == {-1.0}
    assert len(np.unique(vertex_components(len(wall.vertices), wall.faces[found])[wall.faces[found]])) == 1


def test_the_plate_has_millimetres_on_it_and_the_front_before_it() -> None:
    act = """const { bodiesOf } = modules["picture/shapes"], head = { silhouette_mm: [[1, 0], [5, 9]], boxes: [] };
    return tables.map((table) => [...bodiesOf({ table, cradle: [], head }, false).table.lines.places]);"""
    round_plate, rectangle = (
        {"radius_mm": 100.0, "thickness_mm": 5.0, "clips": []},
        {"size_mm": [200.0, 100.0], "radius_mm": 112.0, "thickness_mm": 5.0, "clips": []},
    )
    lines = run(TEMPLATE / "picture" / "shapes.js", act, tables=[round_plate, rectangle])
    ends = [np.reshape(places, (-1, 2, 3)) for places in lines]
    for strokes, low_mm in zip(ends, (-100.0, -50.0), strict=True):
        front = strokes[(strokes[:, :, 1] < low_mm - 1).all(axis=1)]
        assert abs(front[:, :, 0].mean()) < 1.5  # FRONT is in front of the middle
    ticks = {round(float(-a[1]), 2) for a, b in ends[0] if a[0] == 0.0 and a[1] == b[1] <= 0.0 < b[0] < 1.0}
    assert ticks == {4.0 * k for k in range(26)}


def test_clips_are_drawn_at_their_place_on_the_plate() -> None:
    act = """const { bodiesOf } = modules["picture/shapes"], head = { silhouette_mm: [[1, 0], [5, 9]], boxes: [] };
    return [...bodiesOf({ table, cradle: [], head }, false).table.solid.places];"""
    clips = [{"name": "clip", "min_mm": [-10.0, 80.0, 0.0], "max_mm": [10.0, 95.0, 6.0]}]
    table = {"radius_mm": 100.0, "thickness_mm": 5.0, "clips": clips}
    corners = np.reshape(run(TEMPLATE / "picture" / "shapes.js", act, table=table), (-1, 3))
    above = corners[corners[:, 2] > 0.0]
    assert (above.min(axis=0).tolist(), above.max(axis=0).tolist()) == ([-10.0, 80.0, 6.0], [10.0, 95.0, 6.0])
