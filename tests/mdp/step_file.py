"""A box as a STEP file (ISO 10303-21, AP214): a boundary representation of six planes, written by hand."""

from collections.abc import Iterable, Sequence
from itertools import pairwise, product

HEADER = (
    "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;"
)
FACE = ((0, 0), (1, 0), (1, 1), (0, 1))
Corner = tuple[int, int, int]


class Entities(list[str]):
    """The instances of a file: each gets the next number, by which others name it."""

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
    box = _Box(sides)
    shell = box.entities.add("CLOSED_SHELL", "''", _list(box.face(axis, side) for axis in range(3) for side in (0, 1)))
    _product(box.entities, box.entities.add("MANIFOLD_SOLID_BREP", "'box'", shell), prefix)
    return "\n".join([HEADER, *box.entities, "ENDSEC;", "END-ISO-10303-21;", ""])


class _Box:
    def __init__(self, sides: tuple[float, float, float]) -> None:
        self.entities = Entities()
        corners = product((0, 1), repeat=3)
        self.places = {corner: [side * at for side, at in zip(sides, corner, strict=True)] for corner in corners}
        self.vertices = {
            corner: self.entities.add("VERTEX_POINT", "''", self.entities.point(point)) for corner, point in self.places.items()
        }
        self.edges: dict[tuple[Corner, Corner], tuple[str, str]] = {}

    def face(self, axis: int, side: int) -> str:
        """The side of the box at the end of an axis."""
        add, across = self.entities.add, (axis + 1) % 3
        loop: list[Corner] = [self._corner(axis, side, u, v) for u, v in (FACE if side else FACE[::-1])]
        edges = [add("ORIENTED_EDGE", "''", "*", "*", *self._edge(*ends)) for ends in pairwise([*loop, loop[0]])]
        bound = add("FACE_OUTER_BOUND", "''", add("EDGE_LOOP", "''", _list(edges)), ".T.")
        normal = [(1.0 if side else -1.0) * (k == axis) for k in range(3)]
        frame = self.entities.frame(self.places[loop[0]], normal, [float(k == across) for k in range(3)])
        return add("ADVANCED_FACE", "''", _list([bound]), add("PLANE", "''", frame), ".T.")

    def _corner(self, axis: int, side: int, u: int, v: int) -> Corner:
        value = {axis: side, (axis + 1) % 3: u, (axis + 2) % 3: v}
        return value[0], value[1], value[2]

    def _edge(self, start: Corner, end: Corner) -> tuple[str, str]:
        """The edge between two corners, and whether it runs that way."""
        if (start, end) not in self.edges:
            add, way = self.entities.add, [b - a for a, b in zip(start, end, strict=True)]
            vector = add("VECTOR", "''", self.entities.direction(way), "1.")
            line = add("LINE", "''", self.entities.point(self.places[start]), vector)
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
