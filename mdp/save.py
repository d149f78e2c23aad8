"""Save: meshes as a 3MF package, and a decomposition as STL files, one coloured 3MF, one coloured GLB and JSON values."""

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from html import escape  # xml.sax would load ssl and email with it
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mdp.decomposition import Decomposition, FrontRow
from mdp.joint import Joint, weakest_of
from mdp.mesh import Mesh
from mdp.plane import Plane

# Okabe and Ito's palette, which colour-blind people can distinguish.
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#999999")
_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>{}</Types>'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "{}</Relationships>"
)
_THUMBNAIL = (
    '<Relationship Target="/{}" Id="rel1" '
    'Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>'
)
_MODEL = (
    '<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" xml:lang="en" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
)
MODEL_PART = "3D/3dmodel.model"
_DATE = (1980, 1, 1, 0, 0, 0)  # date of all entries, fixed so that the bytes are always the same

_GLTF = 0.001 * np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1000.0]])  # mm with z up to metres with y up

FOLDER_FILES = ("decomposition.3mf", "decomposition.json", "plan.toml", "decomposition.glb")  # beside the parts in a folder
PART_FILES = "part-[0-9][0-9]*.stl"  # glob pattern of the names from part_file
HEADING = b"tiltprint part"  # heading of the STL files that stl() returns


def part_file(index: int) -> str:
    """File name of a part's STL."""
    return f"part-{index:02d}.stl"


def stl(mesh: Mesh) -> bytes:
    """The mesh as binary STL."""
    facets = np.zeros(len(mesh.faces), _STL)
    facets["normal"] = mesh.normals
    facets["corners"] = mesh.vertices[mesh.faces]
    return HEADING.ljust(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()


def threemf(decomposition: Decomposition) -> bytes:
    """All parts in place in one 3MF, each an object with its own colour; deterministic."""
    content = io.BytesIO()
    write_package(content, model_xml([(part.mesh, f"part {part.index}") for part in decomposition.parts], coloured=True))
    return content.getvalue()


def model_xml(bodies: Sequence[tuple[Mesh, str]], metadata: Mapping[str, str] | None = None, coloured: bool = False) -> str:
    """The model part of a 3MF package with named meshes in place. coloured: each mesh gets its own colour."""
    names = [escape(name, quote=False).replace('"', "&quot;") for _, name in bodies]
    said = "".join(f'<metadata name="{key}">{escape(text, quote=False)}</metadata>' for key, text in (metadata or {}).items())
    bases = "".join(f'<base name="{name}" displaycolor="{COLOURS[k % len(COLOURS)]}FF"/>' for k, name in enumerate(names))
    materials = f'<basematerials id="1">{bases}</basematerials>' if coloured else ""
    objects = "".join(_object(mesh, names[k], k, coloured) for k, (mesh, _) in enumerate(bodies))
    items = "".join(f'<item objectid="{k + 2}"/>' for k in range(len(bodies)))
    return f"{_MODEL}{said}<resources>{materials}{objects}</resources><build>{items}</build></model>"


def write_package(file: BinaryIO, model: str, others: Sequence[tuple[str, bytes]] = ()) -> None:
    """Write a 3MF package: its model part and other files by name; a PNG among them is its thumbnail."""
    suffixes = sorted({suffix for name, _ in others if (suffix := Path(name).suffix.removeprefix(".").lower())})
    kinds = {"png": "image/png"}
    types = "".join(
        f'<Default Extension="{escape(suffix, quote=False)}" ContentType="{kinds.get(suffix, "application/octet-stream")}"/>'
        for suffix in suffixes
        if suffix not in ("rels", "model")
    )
    pictures = "".join(_THUMBNAIL.format(name) for name, _ in others if name.endswith(".png"))
    parts = [
        ("[Content_Types].xml", _TYPES.format(types).encode()),
        ("_rels/.rels", _RELATIONS.format(pictures).encode()),
        (MODEL_PART, model.encode()),
    ]
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in (*parts, *others):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)


def glb(decomposition: Decomposition) -> bytes:
    """All parts in place as one scene for viewers, named and coloured, in print order; deterministic.

    In metres with y up, as glTF specifies: each part, in mm with z up, has a node that turns and scales it.
    """
    from trimesh import Scene
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    scene = Scene(base_frame="workpiece")
    for part in decomposition.parts:
        body, name = part.mesh.to_trimesh(), part_file(part.index).removesuffix(".stl")
        colour = bytes.fromhex(COLOURS[(part.index - 1) % len(COLOURS)][1:])
        body.visual = TextureVisuals(material=PBRMaterial(name, baseColorFactor=[*colour, 255], metallicFactor=0.0))
        scene.add_geometry(body, node_name=name, geom_name=name, transform=_GLTF)
    return bytes(scene.export(file_type="glb"))


def json_values(decomposition: Decomposition, joints: Sequence[Joint], read_s: float, total_s: float) -> dict[str, Any]:
    """The values that `decompose --json` writes."""
    return {
        "model": decomposition.name,
        "faces": len(decomposition.mesh.faces),
        "beam_width": decomposition.beam_width,
        "ranker": decomposition.ranker,
        "seconds": {"read": round(read_s, 3), "search": round(decomposition.search_s, 3), "total": round(total_s, 3)},
        "risky_area_mm2": decomposition.risky_area_mm2,
        "residual_area_mm2": decomposition.residual_area_mm2,
        "reduction": decomposition.reduction,
        "cost_mm2": decomposition.cost_mm2,
        "seam_mm": decomposition.seam_mm,
        "stairs_mm2": decomposition.stairs_mm2,
        "volume_mm3": decomposition.volume_mm3,
        "candidates_evaluated": decomposition.candidates_evaluated,
        "rounds": decomposition.rounds,
        "parts": [
            {
                "index": part.index,
                "direction": part.direction.tolist(),
                "base": plane_values(part.base),
                "tilt_deg": part.pose.tilt_deg,
                "turn_deg": part.pose.turn_deg,
                "volume_mm3": part.volume_mm3,
                "risky_area_mm2": part.risky_area_mm2,
                "feather_share": part.feather_share,
                "faces": len(part.mesh.faces),
                "file": part_file(part.index),
            }
            for part in decomposition.parts
        ],
        "joints": joint_values(joints),
        "front": [front_values(row) for row in decomposition.front],
    }


def joint_values(joints: Sequence[Joint]) -> list[dict[str, Any]]:
    """Joints as JSON values, the one that breaks first marked as the weakest."""
    return [asdict(joint) | {"weakest": joint is weakest_of(joints)} for joint in joints]


def front_values(row: FrontRow) -> dict[str, Any]:
    """A row of the front as JSON values."""
    names = ("parts", "support_area_mm2", "seam_mm", "stairs_mm2", "cost_mm2", "time_s", "filament_mm", "chosen")
    return {name: getattr(row, name) for name in names}


def plane_values(plane: Plane) -> dict[str, Any]:
    """A plane as JSON values."""
    limbs = {} if plane.limbs_mm is None else {"limbs_mm": plane.limbs_mm.tolist()}
    return {"normal": plane.normal.tolist(), "offset_mm": plane.offset_mm, **limbs}


def _object(mesh: Mesh, name: str, number: int, coloured: bool) -> str:
    vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in mesh.vertices.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist())
    colour = f' pid="1" pindex="{number}"' if coloured else ""
    return (
        f'<object id="{number + 2}" name="{name}" type="model"{colour}><mesh>'
        f"<vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>"
    )
