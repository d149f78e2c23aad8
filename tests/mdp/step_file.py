"""Hand-written STEP files (ISO 10303-21, AP214) of prisms and cylinders as boundary representations."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

HEADER = (
    "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;"
)
Corner = tuple[float, float]


class Entities(list[str]):
    """The instances of a file: each gets the next number, by which others refer to it."""

    def add(self, name: str, *values: object) -> str:
        self.append(f"#{len(self) + 1}={name}({','.join(map(str, values))});")
        return f"#{len(self)}"

    def point(self, values: Iterable[float]) -> str:
        return self.add("CARTESIAN_POINT", "''", _list(map(float, values)))

    def direction(self, values: Iterable[float]) -> str:
        return self.add("DIRECTION", "''", _list(map(float, values)))

    def frame(self, origin: Sequence[float], z: Sequence[float], x: Sequence[float]) -> str:
        return self.add("AXIS2_PLACEMENT_3D", "''", self.point(origin), self.direction(z), self.direction(x))


def step_box(sides: tuple[float, float, float], prefix: str = ".MILLI.") -> str:
    """The file of a box with a corner at the origin; prefix: of the metre, `$` for none."""
    x, y, z = sides
    return step_prism([(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)], z, prefix=prefix)


def step_assembly(*boxes: tuple[str, tuple[float, float, float]]) -> str:
    """The file of named boxes with a corner at the origin, without a common product."""
    rows: list[str] = []
    for name, sides in boxes:
        shift = len(rows)
        own = re.findall(r"^#.*;$", step_box(sides).replace("'box'", f"'{name}'"), re.MULTILINE)
        rows += [re.sub(r"#(\d+)", lambda found, shift=shift: f"#{int(found[1]) + shift}", row) for row in own]
    return "\n".join([HEADER, *rows, "ENDSEC;", "END-ISO-10303-21;", ""])


def painted(file: str, colours: Mapping[int, tuple[float, float, float]]) -> str:
    """The file with a colour (red, green, blue, 0 to 1) for faces by their index in it; -1: for the solid."""
    ids = [re.findall(rf"#(\d+)={name}", file) for name in ("ADVANCED_FACE", "MANIFOLD_SOLID_BREP", r"\(?GEOMETRIC_REP")]
    entities = Entities([""] * max(map(int, re.findall(r"#(\d+)=", file))))
    first, items = len(entities), []
    for place, colour in colours.items():
        fill = entities.add("FILL_AREA_STYLE_COLOUR", "''", entities.add("COLOUR_RGB", "''", *map(float, colour)))
        area = entities.add("SURFACE_STYLE_FILL_AREA", entities.add("FILL_AREA_STYLE", "''", _list([fill])))
        usage = entities.add("SURFACE_STYLE_USAGE", ".BOTH.", entities.add("SURFACE_SIDE_STYLE", "''", _list([area])))
        style = entities.add("PRESENTATION_STYLE_ASSIGNMENT", _list([usage]))
        item = ids[1][0] if place < 0 else ids[0][place]
        items.append(entities.add("STYLED_ITEM", "''", _list([style]), f"#{item}"))
    entities.add("MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION", "''", _list(items), f"#{ids[2][0]}")
    return file.replace("ENDSEC;\nEND-ISO", "\n".join([*entities[first:], "ENDSEC;\nEND-ISO"]))


def step_prism(base: Sequence[Corner], height: float, top: float = 1.0, prefix: str = ".MILLI.") -> str:
    """The file of a prism over a counter-clockwise polygon; top: factor on the upper polygon, which gives a frustum."""
    count = len(base)
    points = [(x, y, 0.0) for x, y in base] + [(top * x, top * y, height) for x, y in base]
    sides = [(k, (k + 1) % count, count + (k + 1) % count, count + k) for k in range(count)]
    solid = _Faceted(points)
    return _file(solid.entities, [solid.face(loop) for loop in (range(count)[::-1], range(count, 2 * count), *sides)], prefix)


def step_cylinder(radius: float, height: float) -> str:
    """The file of a cylinder about z, its side one curved face."""
    entities, up, x = Entities(), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    add = entities.add
    ends = [add("VERTEX_POINT", "''", entities.point((radius, 0.0, z))) for z in (0.0, height)]
    frames = [entities.frame((0.0, 0.0, z), up, x) for z in (0.0, height)]
    rims = [
        add("EDGE_CURVE", "''", end, end, add("CIRCLE", "''", frame, radius), ".T.")
        for end, frame in zip(ends, frames, strict=True)
    ]
    line = add("LINE", "''", entities.point((radius, 0.0, 0.0)), add("VECTOR", "''", entities.direction(up), "1."))
    seam = add("EDGE_CURVE", "''", *ends, line, ".T.")

    def face(edges: Iterable[tuple[str, str]], surface: str, sense: str = ".T.") -> str:
        loop = add("EDGE_LOOP", "''", _list([add("ORIENTED_EDGE", "''", "*", "*", *edge) for edge in edges]))
        return add("ADVANCED_FACE", "''", _list([add("FACE_OUTER_BOUND", "''", loop, ".T.")]), surface, sense)

    side = [(rims[0], ".T."), (seam, ".T."), (rims[1], ".F."), (seam, ".F.")]
    faces = [
        face(side, add("CYLINDRICAL_SURFACE", "''", frames[0], radius)),
        face([(rims[0], ".F.")], add("PLANE", "''", frames[0]), ".F."),
        face([(rims[1], ".T.")], add("PLANE", "''", frames[1])),
    ]
    return _file(entities, faces, ".MILLI.")


def _file(entities: Entities, faces: Iterable[str], prefix: str) -> str:
    shell = entities.add("CLOSED_SHELL", "''", _list(faces))
    _product(entities, entities.add("MANIFOLD_SOLID_BREP", "'solid'", shell), prefix)
    return "\n".join([HEADER, *entities, "ENDSEC;", "END-ISO-10303-21;", ""])


class _Faceted:
    """A solid of plane faces, each edge shared by two faces."""

    def __init__(self, points: Sequence[Sequence[float]]) -> None:
        self.entities, self.points = Entities(), points
        self.vertices = [self.entities.add("VERTEX_POINT", "''", self.entities.point(point)) for point in points]
        self.edges: dict[tuple[int, int], tuple[str, str]] = {}

    def face(self, loop: Sequence[int]) -> str:
        """The face whose corners run counter-clockwise seen from outside."""
        add = self.entities.add
        edges = [add("ORIENTED_EDGE", "''", "*", "*", *self._edge(*ends)) for ends in pairwise([*loop, loop[0]])]
        bound = add("FACE_OUTER_BOUND", "''", add("EDGE_LOOP", "''", _list(edges)), ".T.")
        corners = np.array([self.points[corner] for corner in loop])
        normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)  # Newell's method
        frame = self.entities.frame(corners[0], normal, corners[1] - corners[0])
        return add("ADVANCED_FACE", "''", _list([bound]), add("PLANE", "''", frame), ".T.")

    def _edge(self, start: int, end: int) -> tuple[str, str]:
        """The edge between two corners, and whether it runs in that direction."""
        if (start, end) not in self.edges:
            add, way = self.entities.add, [b - a for a, b in zip(self.points[start], self.points[end], strict=True)]
            vector = add("VECTOR", "''", self.entities.direction(way), "1.")
            line = add("LINE", "''", self.entities.point(self.points[start]), vector)
            edge = add("EDGE_CURVE", "''", self.vertices[start], self.vertices[end], line, ".T.")
            self.edges[start, end], self.edges[end, start] = (edge, ".T."), (edge, ".F.")
        return self.edges[start, end]


def _list(values: Iterable[object]) -> str:
    return f"({','.join(map(str, values))})"


def _product(entities: Entities, solid: str, prefix: str) -> None:
    """The solid as the shape of a product, with its units."""
    add = entities.add
    length = add("", f"LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.)")
    angle = add("", "NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.)")
    solid_angle = add("", "NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT()")
    error = add("UNCERTAINTY_MEASURE_WITH_UNIT", "LENGTH_MEASURE(1.E-7)", length, "''", "''")
    units = f"GLOBAL_UNIT_ASSIGNED_CONTEXT({_list([length, angle, solid_angle])})REPRESENTATION_CONTEXT('','')"
    context = add("", f"GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT({_list([error])}){units}")
    frame = entities.frame((0, 0, 0), (0, 0, 1), (1, 0, 0))
    shape = add("ADVANCED_BREP_SHAPE_REPRESENTATION", "''", _list([frame, solid]), context)
    application = add("APPLICATION_CONTEXT", "'automotive design'")
    add("APPLICATION_PROTOCOL_DEFINITION", "'international standard'", "'automotive_design'", 2000, application)
    box = add("PRODUCT", "'box'", "'box'", "''", _list([add("PRODUCT_CONTEXT", "''", application, "'mechanical'")]))
    formation = add("PRODUCT_DEFINITION_FORMATION", "''", "''", box)
    stage = add("PRODUCT_DEFINITION_CONTEXT", "'part definition'", application, "'design'")
    definition = add("PRODUCT_DEFINITION", "'design'", "''", formation, stage)
    add("SHAPE_DEFINITION_REPRESENTATION", add("PRODUCT_DEFINITION_SHAPE", "''", "''", definition), shape)
