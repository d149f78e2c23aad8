"""Small hand-written model files, so that the readers are not tested with our own writers."""

import json
import struct
import zipfile
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Mesh
from mdp.read import read_mesh
from profiles.errors import MeshError
from tests.shapes import from_manifold

SHARED = Path(__file__).parents[3] / "shared"


def placed(x: float, y: float, z: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    """A box with one corner at a point."""
    return from_manifold(m3.Manifold.cube((x, y, z)).translate(at))


def both(a: Mesh, b: Mesh) -> Mesh:
    """Two meshes as one list of triangles."""
    return Mesh(np.concatenate([a.vertices, b.vertices]), np.concatenate([a.faces, b.faces + len(a.vertices)]))


def inside_out(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def without(mesh: Mesh, *faces: int) -> Mesh:
    return Mesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0))


def plus(mesh: Mesh, faces: object) -> Mesh:
    return Mesh(mesh.vertices, np.concatenate([mesh.faces, np.asarray(faces).reshape(-1, 3)]))


def stl(mesh: Mesh, header: bytes = b"binary") -> bytes:
    corners = mesh.vertices[mesh.faces].astype("<f4")
    facets = b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in corners)
    return header.ljust(80) + struct.pack("<I", len(corners)) + facets


def ascii_stl(mesh: Mesh, name: str = "vertex of a facet") -> bytes:
    lines = [f"solid {name}"]
    for triangle in mesh.vertices[mesh.faces].tolist():
        lines += [
            "facet normal nan 0 0",
            " outer loop",
            *("  vertex {!r} {!r} {!r}".format(*p) for p in triangle),
            " endloop",
            "endfacet",
        ]
    return "\n".join([*lines, f"endsolid {name}\n"]).encode()


def off(mesh: Mesh) -> bytes:
    return f"OFF # made here\n{len(mesh.vertices)} {len(mesh.faces)} 0\n{_rows(mesh.vertices)}{_rows(mesh.faces, '3 ')}".encode()


def obj(mesh: Mesh) -> bytes:
    return f"o part\n{_rows(mesh.vertices, 'v ')}vn 0 0 1\n{_rows(mesh.faces + 1, 'f ')}".encode()


def ply(mesh: Mesh, order: str = "ascii") -> bytes:
    header = f"ply\nformat {order} 1.0\ncomment x\nelement vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\n"
    header += f"property double z\nproperty uchar red\nelement face {len(mesh.faces)}\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    if order == "ascii":
        return (
            header + "".join(f"{x!r} {y!r} {z!r} 7\n" for x, y, z in mesh.vertices.tolist()) + _rows(mesh.faces, "3 ")
        ).encode()
    sign = "<" if "little" in order else ">"
    rows = [struct.pack(sign + "dddB", *point, 7) for point in mesh.vertices.tolist()]
    return header.encode() + b"".join(rows + [struct.pack(sign + "Biii", 3, *face) for face in mesh.faces.tolist()])


def painted_ply(mesh: Mesh) -> bytes:
    """The mesh with the colours of its faces."""
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(mesh.vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
    )
    header += f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\n"
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    assert mesh.colours is not None
    parts = [mesh.faces, mesh.colours[:, None] >> np.array([16, 8, 0]) & 255]
    return (header + _rows(mesh.vertices) + _rows(np.concatenate(parts, axis=1), "3 ")).encode()


def _rows(table: object, start: str = "") -> str:
    return "".join(start + " ".join(map(repr, row)) + "\n" for row in np.asarray(table).tolist())


def glb(mesh: Mesh, node: dict[str, object] | None = None) -> bytes:
    indices, points = mesh.faces.astype("<u4").tobytes(), mesh.vertices.astype("<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **(node or {})}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": mesh.faces.size, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": len(mesh.vertices), "type": "VEC3"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(indices)},
            {"buffer": 0, "byteOffset": len(indices), "byteLength": len(points)},
        ],
        "buffers": [{"byteLength": len(indices) + len(points)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = (
        struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", len(indices + points), 0x004E4942)
        + indices
        + points
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def threemf_mesh(mesh: Mesh) -> str:
    """The mesh element of an object."""
    points = "".join('<vertex x="{!r}" y="{!r}" z="{!r}"/>'.format(*p) for p in mesh.vertices.tolist())
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*f) for f in mesh.faces.tolist())
    return f"<mesh><vertices>{points}</vertices><triangles>{faces}</triangles></mesh>"


def threemf_model(objects: dict[int, str], items: str = "", unit: str = "millimeter") -> str:
    """A model part: the content of each object by its number, and the build's items as they are in the file."""
    resources = "".join(f'<object id="{number}" type="model">{content}</object>' for number, content in objects.items())
    core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    production = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
    start = f'<model unit="{unit}" xmlns="{core}" xmlns:p="{production}">'
    return f"{start}<resources>{resources}</resources><build>{items}</build></model>"


def threemf(
    path: Path, objects: dict[int, str], items: str, unit: str = "millimeter", parts: dict[str, str] | None = None
) -> Path:
    """A 3MF package of a model part and other parts by their names."""
    relation = '<Relationship Target="/3D/a.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    relations = f'<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{relation}</Relationships>'
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("_rels/.rels", relations)
        for name, text in {"3D/a.model": threemf_model(objects, items, unit), **(parts or {})}.items():
            archive.writestr(name, text)
    return path


def written(path: Path, mesh: Mesh) -> Path:
    """The mesh written in the format of the path's suffix."""
    if path.suffix == ".3mf":
        return threemf(path, {1: threemf_mesh(mesh)}, '<item objectid="1"/>')
    path.write_bytes({".stl": stl, ".off": off, ".obj": obj, ".ply": ply, ".glb": glb}[path.suffix](mesh))
    return path


def save(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def refusal(path: Path, **arguments: float) -> str:
    """The error message of reading the file, which must name it."""
    with pytest.raises(MeshError) as caught:
        read_mesh(path, **arguments)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}")
    assert not sentence.endswith(".")
    assert "\n" not in sentence
    return sentence.removeprefix(f"{path}").lstrip(": ")
