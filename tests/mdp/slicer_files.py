"""Slicer files as PrusaSlicer, Bambu Studio and OrcaSlicer write them, made of solids with a known union."""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Floats, Mesh, together
from tests.mdp.files import threemf_mesh, threemf_model
from tests.shapes import from_manifold

PRUSASLICERS = {
    "part": "ModelPart",
    "negative": "NegativeVolume",
    "modifier": "ParameterModifier",
    "support": "SupportEnforcer",
    "no_support": "SupportBlocker",
}
BAMBUS = {
    "part": "normal_part",
    "negative": "negative_part",
    "modifier": "modifier_part",
    "support": "support_enforcer",
    "no_support": "support_blocker",
}
RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/3dmodel.model"/></Relationships>'
)
BLOCK = m3.Manifold.cube((30.0, 30.0, 20.0), True)
BOX = m3.Manifold.cube((10.0, 8.0, 30.0), True)
CYLINDER = m3.Manifold.cylinder(40.0, 5.0, circular_segments=24, center=True)
DIALECTS = ("prusaslicer", "bambu")
CONFIG = "Metadata/Slic3r_PE_model.config"


@dataclass(frozen=True)
class Made:
    """A volume of an object: its solid in the object's frame, its type and its settings."""

    solid: m3.Manifold
    kind: str = "part"
    settings: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Placed:
    """An instance of an object: its transform (4, 3), its plate, and whether it is printed."""

    transform: Floats
    plate: int = 1
    printable: bool = True


@dataclass(frozen=True)
class Object:
    """An object of a slicer file, its instances and its settings."""

    volumes: Sequence[Made]
    instances: Sequence[Placed]
    settings: Mapping[str, str] = field(default_factory=dict)


AT_ORIGIN = Placed(np.vstack([np.eye(3), [0.0, 0.0, 10.0]]))


def printed(objects: Sequence[Object], plate: int = 1) -> m3.Manifold:
    """The solid printed on a plate, in the frame of the file."""
    solids = []
    for own in objects:
        parts = m3.Manifold.batch_boolean([made.solid for made in own.volumes if made.kind == "part"], m3.OpType.Add)
        negative = m3.Manifold.batch_boolean([made.solid for made in own.volumes if made.kind == "negative"], m3.OpType.Add)
        for at in own.instances:
            if at.printable and at.plate == plate:
                solids.append((parts - negative).transform(at.transform.T))
    return m3.Manifold.batch_boolean(solids, m3.OpType.Add)


def prusaslicer(path: Path, objects: Sequence[Object], further: Mapping[str, str] | None = None) -> Path:
    """All volumes of an object in one mesh; a second instance is an object with the first as its component."""
    written, items, config = dict[int, str](), [], []
    for own in objects:
        first = len(written) + 1
        meshes, triangles, begin = [from_manifold(made.solid) for made in own.volumes], [], 0
        for made, mesh in zip(own.volumes, meshes, strict=True):
            entries = {"name": made.kind, "volume_type": PRUSASLICERS[made.kind], "source_file": "a.stl", **made.settings}
            volume = f'<volume firstid="{begin}" lastid="{begin + len(mesh.faces) - 1}">{_prusas(entries, "volume")}</volume>'
            triangles.append(volume)
            begin += len(mesh.faces)
        written[first] = threemf_mesh(together(meshes))
        config.append(f'<object id="{first}">{_prusas({"name": "b", **own.settings}, "object")}{"".join(triangles)}</object>')
        for number, at in enumerate(own.instances, start=first):
            if number > first:
                written[number] = f'<components><component objectid="{first}"/></components>'
            items.append(_item(number, at))
    config_xml = f'<?xml version="1.0"?><config>{"".join(config)}</config>'
    version = '<metadata name="slic3rpe:Version3mf">1</metadata><resources>'
    model = threemf_model(written, "".join(items)).replace("<resources>", version)
    return _package(path, model, {"Metadata/Slic3r_PE_model.config": config_xml, **(further or {})})


def bambu(path: Path, objects: Sequence[Object], rng: np.random.Generator, further: Mapping[str, str] | None = None) -> Path:
    """Each volume in a part of its own with its own transform, as a component of its object."""
    written, items, config, parts, plates = dict[int, str](), [], [], dict[str, str](), dict[int, list[str]]()
    number = 1
    for place, own in enumerate(objects):
        name, meshes, components, told = f"3D/Objects/object_{place + 1}.model", dict[int, str](), [], []
        for made in own.volumes:
            moved = affine(rng)
            inverse = np.linalg.inv(np.vstack([moved.T, [0.0, 0.0, 0.0, 1.0]]))[:3]
            mesh = from_manifold(made.solid.transform(inverse))
            meshes[number] = threemf_mesh(mesh)
            components.append(f'<component p:path="/{name}" objectid="{number}" transform="{_numbers(moved)}"/>')
            told.append(
                f'<part id="{number}" subtype="{BAMBUS[made.kind]}">{_entries({"name": made.kind, **made.settings})}</part>'
            )
            number += 1
        parts[name] = threemf_model(meshes).replace('type="model"', 'type="other"')
        written[number] = f"<components>{''.join(components)}</components>"
        config.append(f'<object id="{number}">{_entries({"name": "b", **own.settings})}{"".join(told)}</object>')
        for k, at in enumerate(own.instances):
            items.append(_item(number, at))
            standing = _entries({"object_id": str(number), "instance_id": str(k)})
            plates.setdefault(at.plate, []).append(f"<model_instance>{standing}</model_instance>")
        number += 1
    for plate, instances in sorted(plates.items()):
        config.append(f"<plate>{_entries({'plater_id': str(plate), 'plater_name': ''})}{''.join(instances)}</plate>")
    config_xml = f'<?xml version="1.0"?><config>{"".join(config)}</config>'
    model = threemf_model(written, "".join(items)).replace("<model ", '<model requiredextensions="p" ')
    return _package(path, model, {**parts, "Metadata/model_settings.config": config_xml, **(further or {})})


def written(path: Path, dialect: str, objects: Sequence[Object], seed: int = 0, further: Mapping[str, str] | None = None) -> Path:
    if dialect == "bambu":
        return bambu(path, objects, np.random.default_rng(seed), further)
    return prusaslicer(path, objects, further)


def check(mesh: Mesh, expected: m3.Manifold) -> None:
    box = np.array(expected.bounding_box()).reshape(2, 3)
    assert mesh.volume_mm3 == pytest.approx(expected.volume(), rel=1e-6)
    np.testing.assert_allclose(np.ptp(mesh.bounds_mm, axis=0), np.ptp(box, axis=0), rtol=1e-6)


def change(path: Path, part: str, old: str, new: str) -> None:
    """Replace a part of a package."""
    with zipfile.ZipFile(path) as archive:
        texts = {name: archive.read(name).decode() for name in archive.namelist()}
    assert old in texts[part]
    texts[part] = texts[part].replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in texts.items():
            archive.writestr(name, text)


def paint(path: Path, rows: Sequence[int], attributes: str) -> None:
    """Give some triangles of the model part attributes."""
    part = "3D/3dmodel.model"
    with zipfile.ZipFile(path) as archive:
        text = archive.read(part).decode()
    pieces = text.split("<triangle ")
    change(
        path, part, text, "<triangle ".join(f"{attributes} {piece}" if k - 1 in rows else piece for k, piece in enumerate(pieces))
    )


def affine(rng: np.random.Generator) -> Floats:
    """(4, 3) a rotation, scales of 0.5 to 2 along its axes, maybe a mirroring, and a shift."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    scales = rng.uniform(0.5, 2.0, 3) * rng.choice([-1.0, 1.0], 3)
    return np.vstack([np.diag(scales) @ turn, rng.uniform(-20.0, 20.0, 3)])


def _package(path: Path, model: str, further: Mapping[str, str]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in {"_rels/.rels": RELATIONS, "3D/3dmodel.model": model, **further}.items():
            archive.writestr(name, text)
    return path


def _item(number: int, at: Placed) -> str:
    return f'<item objectid="{number}" transform="{_numbers(at.transform)}" printable="{int(at.printable)}"/>'


def _numbers(transform: Floats) -> str:
    return " ".join(map(repr, transform.ravel().tolist()))


def _prusas(values: Mapping[str, str], kind: str) -> str:
    return "".join(f'<metadata type="{kind}" key={quoteattr(key)} value={quoteattr(text)}/>' for key, text in values.items())


def _entries(values: Mapping[str, str]) -> str:
    return "".join(f"<metadata key={quoteattr(key)} value={quoteattr(text)}/>" for key, text in values.items())
