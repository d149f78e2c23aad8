"""Report beside the picture: figures of the print, its parts, line kinds and alternatives, and its settings.

All values are texts ready to be shown, so that the page computes nothing.
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun, summary
from machine.gcode.reader.parsed import MoveKind
from machine.program import Alternative, Program
from machine.quantities import amount, duration, filament_g, newtons, percent, price_in_words
from machine.view.parts import risky_before_mm2
from machine.view.paths import PRIME, WIPE, Layers, page_kinds
from mdp.cost.cost import needing_upright
from mdp.decomposition import Decomposition, Part
from mdp.directions.orientation import best_orientation, in_words, set_on_plate
from mdp.joint import Joint, weakest_of
from profiles.errors import ProfileError, counted
from profiles.frozen import Frozen
from profiles.messages import terminal_words, three_digits
from profiles.places import OF_KIND, shipped
from profiles.profile import DEFAULTS, SECTIONS, Profile, label_of, load_one, rows

Table = dict[str, Any]
Row = list[str]
MOVES = {
    MoveKind.TRAVEL: "travel", MoveKind.RETRACT: "retraction", PRIME: "prime", WIPE: "wipe", MoveKind.ROTATE: "turning the table",
}  # fmt: skip
UNKNOWN = "unknown"
COMPARED = "Compared"
COSTS = (
    "time",
    "filament m",
    "plastic g",
    "support cm³",
    "interfaces cm³",
    "seams mm",
    "stair-stepping mm²",
    "findings",
    "risky mm²",
)
STANDS_ON = "base cm³"
CUT = "base: plastic that the interface below the part adds, compared with a print in one piece"
LAID = ["contact %", "plastic %"]
CONTACT = (
    "contact: share of the joint's section that is covered by beads of the first layer and supported by earlier parts; plastic: "
    "volume of these beads as a share of the room below the nozzle"
)
BREAKS = "breaks: force sideways at the tip of the part, the farthest point that it holds; an estimate of the cold weld alone"
RISKY = "risky: faces that would need support in one piece in the present orientation; left: as the part is printed"


def parts_report(
    decomposition: Decomposition, profile: Profile, joints: Sequence[Joint], alternatives: Sequence[Alternative] = ()
) -> dict[str, Any]:
    """The report of a page of parts alone; alternatives: their costs, if known."""
    facts = [
        ["parts", str(len(decomposition.parts))],
        ["volume", f"{amount(decomposition.volume_mm3 / 1000.0)} cm³"],
        *_names(profile),
    ]
    rows = [_solid(part, profile) for part in decomposition.parts]
    parts = _table("Parts", SOLID, rows, [RISKY])
    tables = [
        parts,
        *_joints(joints),
        *_front(decomposition),
        _alternatives(alternatives) if alternatives else _areas(decomposition, profile),
        *settings_tables(profile),
    ]
    return {"facts": facts, "tables": tables}


def print_report(
    program: Program,
    profile: Profile,
    layers: Layers,
    parts: Sequence[dict[str, Any]],
    *,
    joints: Sequence[Joint] = (),
    alternatives: Sequence[Alternative] = (),
    known: bool = True,
    ours: bool = True,
) -> dict[str, Any]:
    """The report of a whole print. parts: sums_of_parts(); joints: of a known model; alternatives: the model in one part.

    known: the machine is not a guess; ours: the file was made with this profile, otherwise its settings are left out.
    """
    tables = [_parts(program, parts, profile), _kinds(program.run, profile, "" if known else profile.machine.name)]
    tables += _joints(joints) or _interfaces(program.run)
    if program.decomposition is not None:
        tables += _front(program.decomposition)
        tables.append(_alternatives(alternatives) if alternatives else _areas(program.decomposition, profile))
    names = _names(profile) if ours else _assumptions(profile, known)
    facts = [*_figures(program.run, profile, layers), *names]
    return {"facts": facts, "tables": tables + (settings_tables(profile) if ours else [])}


def with_alternatives(report: dict[str, Any], alternatives: Sequence[Alternative]) -> dict[str, Any]:
    """Replace the table of areas, which costs nothing to compute, by one of the alternatives."""
    tables = [_alternatives(alternatives) if table["title"] == COMPARED else table for table in report["tables"]]
    return report | {"tables": tables}


def _table(title: str, head: Row, rows: list[Row], notes: Sequence[str] = (), folded: bool = False) -> Table:
    return {"title": title, "head": head, "rows": rows, "notes": list(notes), "folded": folded}


SOLID = ["part", "tilt", "turn", "cm³", "risky mm²", "left mm²"]


def _solid(part: Part, profile: Profile) -> Row:
    """A part's pose, volume, and areas that would need and will need support."""
    before = risky_before_mm2(part, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces)
    angles = [f"{three_digits(angle, 1)}°" for angle in (part.pose.tilt_deg, part.pose.turn_deg)]
    areas = [amount(area, 1) for area in (before, part.risky_area_mm2)]
    return [str(part.index), *angles, amount(part.volume_mm3 / 1000.0), *areas]


def _parts(program: Program, parts: Sequence[dict[str, Any]], profile: Profile) -> Table:
    """Table of the parts with layers, time and material, and with their shapes if the model is known."""
    decomposition = program.decomposition
    solids = {part.index: _solid(part, profile) for part in decomposition.parts} if decomposition is not None else {}
    interfaces = program.interface_mm3
    rows = []
    for part in parts:
        index, mass_g = part["index"], filament_g(part["filament_mm"], profile.material)
        figures = [str(part["layers"]), duration(part["time_s"]), amount(mass_g, 1)]
        stands_on = [amount(interfaces.get(index, 0.0) / 1000)] if interfaces else []
        rows.append([*solids.get(index, [str(index) if index else "all"]), *figures, *stands_on])
    head = [*(SOLID if solids else SOLID[:1]), "layers", "time", "g", *([STANDS_ON] if interfaces else [])]
    return _table("Parts", head, rows, [RISKY] * bool(solids) + [CUT] * bool(interfaces))


def _joints(joints: Sequence[Joint]) -> list[Table]:
    """Table of the joints with area, seam, strength, and contact of the first layer if sliced."""
    sliced = any(joint.contact_share is not None for joint in joints)
    weakest, rows = weakest_of(joints), []
    for joint in joints:
        laid = _laid(joint.contact_share, joint.plastic_over_room) if sliced else []
        lengths = [amount(joint.seam_mm, 0), amount(joint.arm_mm, 1)]
        forces = [newtons(joint.load_n), newtons(joint.tension_n)]
        rows.append([str(joint.part), amount(joint.area_mm2, 1), *laid, *lengths, *forces])
    head = ["part", "mm²", *(LAID if sliced else []), "seam mm", "arm mm", "breaks at N", "pulled off at N"]
    notes = [*([CONTACT] if sliced else []), BREAKS]
    notes += [] if weakest is None else [f"the weakest: the joint of part {weakest.part}"]
    return [_table("Joints", head, rows, notes)] if joints else []


def _interfaces(run: DryRun) -> list[Table]:
    """Table of the joints of a program without a model, from its G-code alone."""
    rows = [[str(face.part), amount(face.area_mm2, 1), *_laid(face.contact, face.over_room)] for face in run.interfaces]
    return [_table("Joints", ["part", "mm²", *LAID], rows, [CONTACT])] if rows else []


def _laid(contact: float | None, over_room: float | None) -> Row:
    return [percent(contact, 1), percent(over_room)]


def _front(decomposition: Decomposition) -> list[Table]:
    """Table of the best decomposition for each number of parts; none if there is no choice."""
    front = decomposition.front
    if len(front) < 2:
        return []
    rows, summed = [], any(row.total_mm2 is not None for row in front)
    for row in front:
        time = "–" if row.time_s is None else duration(row.time_s)
        filament = "–" if row.filament_mm is None else amount(row.filament_mm / 1000, 1)
        areas = [amount(row.support_area_mm2, 1), amount(row.seam_mm, 0), amount(row.stairs_mm2, 0), amount(row.cost_mm2, 1)]
        total = ["–" if row.total_mm2 is None else amount(row.total_mm2, 1)] if summed else []
        rows.append([f"{row.parts}{' (chosen)' * row.chosen}", *areas, time, filament, *total])
    notes = [f"chosen {row.reason}" for row in front if row.chosen]
    notes += [f"{counted(row.parts, 'part')} only on request: {row.flaw}" for row in front if row.flaw and not row.chosen]
    notes.append("--parts selects another row; time and filament are estimates")
    return [
        _table(
            "Number of parts",
            ["parts", "needs support mm²", "seams mm", "stair-stepping mm²", "cost mm²", "time", "m", *["total mm²"] * summed],
            rows,
            notes,
        )
    ]


def _kinds(run: DryRun, profile: Profile, guess: str) -> Table:
    """Table of time and material by kind of line, then travels, then waits, which add up to the whole print.

    guess: name of the machine whose speeds were used if the file names none.
    """
    program, kind = run.program, page_kinds(run.program)
    groups: list[tuple[str, NDArray[np.bool_]]] = [
        (name or UNKNOWN, (kind == MoveKind.EXTRUDE) & (program.type == index)) for index, name in enumerate(program.types)
    ]
    groups += [(name, kind == number) for number, name in MOVES.items()]
    spent = [(name, float(run.times_s[rows].sum()), float(program.e_mm[rows].sum())) for name, rows in groups if rows.any()]
    if run.dwell_s > 0:
        spent.append(("waiting", run.dwell_s, 0.0))
    rows = []
    for name, seconds, e_mm in spent:
        filament = [three_digits(e_mm / 1000), three_digits(filament_g(e_mm, profile.material), 1)]
        rows.append([name, duration(seconds), _share(seconds, run.time_s), *filament])
    notes = ["heating and homing are not counted", *([f"times as on {guess}"] if guess else [])]
    return _table("Time and material", ["kind", "time", "share", "m", "g"], rows, notes)


def _areas(decomposition: Decomposition, profile: Profile) -> Table:
    """Table of the risky area straight up, in the best single orientation, and in parts."""
    best = best_orientation(decomposition.mesh, profile.process.self_supporting_angle_deg)
    turned = set_on_plate(decomposition.mesh, best.rotation)
    single = float(turned.areas_mm2[needing_upright(turned, profile)].sum())
    risky_mm2 = [
        ("straight up", decomposition.risky_area_mm2),
        ("best single orientation", single),
        (f"in {len(decomposition.parts)} part{'s' * (len(decomposition.parts) != 1)}", decomposition.residual_area_mm2),
    ]
    whole = decomposition.risky_area_mm2
    rows = [[name, amount(area, 1), _share(whole - area, whole)] for name, area in risky_mm2]
    rows[0][2] = ""
    notes = [f"best single orientation: {in_words(best)}", "--compare also reports time and material"]
    return _table(COMPARED, ["print", "risky mm²", "less"], rows, notes)


def _alternatives(alternatives: Sequence[Alternative]) -> Table:
    """Table of this print beside the model in one part; a row per alternative would be too wide for a phone."""
    columns = []
    for way in alternatives:
        costs = ["-"] * 8
        if way.time_s is not None:
            filament_mm, mass_g, support_mm3 = (value or 0.0 for value in (way.filament_mm, way.filament_g, way.support_mm3))
            volumes = [amount(support_mm3 / 1000), amount(sum(way.interface_mm3.values()) / 1000)]
            scars = [amount(way.seam_mm, 0), amount(way.stairs_mm2, 0), str(way.findings)]
            costs = [duration(way.time_s), amount(filament_mm / 1000), amount(mass_g, 1), *volumes, *scars]
        columns.append([*costs, amount(way.risky_mm2, 1)])
    notes = [f"{way.name}: {terminal_words(note)}" for way in alternatives for note in (way.orientation, way.message) if note]
    rows = [[cost, *values] for cost, *values in zip(COSTS, *columns, strict=True)]
    return _table(COMPARED, ["", *(way.name for way in alternatives)], rows, notes)


def _figures(run: DryRun, profile: Profile, layers: Layers) -> list[Row]:
    values = summary(run)
    count = str(len(layers.first)) if layers.by == "comments" else f"{len(layers.first)}, by their heights"
    mass_g = filament_g(float(run.program.e_mm.sum()), profile.material)
    costs = price_in_words(values["filament_mm"], profile.material)
    return [
        ["time", duration(values["time_s"])],
        ["filament", f"{amount(values['filament_mm'] / 1000)} m, {amount(mass_g, 1)} g"],
        *([["costs", costs]] if costs else []),
        *([["parts", str(values["parts"])]] if values["parts"] else []),
        ["layers", count],
        *[[key, str(values[key])] for key in ("reorientations", "retractions")],
        ["travel", f"{amount(values['travel_mm'] / 1000)} m"],
    ]


def _names(profile: Profile) -> list[Row]:
    return [["machine", profile.machine.name], ["material", profile.material.name], ["process", profile.process.name]]


def _assumptions(profile: Profile, known: bool) -> list[Row]:
    """The rows of _names() for a file that does not name them."""
    machine = profile.machine.name if known else f"{UNKNOWN}: limits, clearance and the plate were not checked"
    return [["machine", machine], ["material", f"{UNKNOWN}: masses for {profile.material.name}"]]


def _share(part: float, whole: float) -> str:
    return f"{percent(part / whole if whole > 0 else 0.0, 1)} %"


def settings_tables(profile: Profile) -> list[Table]:
    """Two tables: keys whose values differ from the defaults, beside these; then all keys with their meanings.

    Defaults are the values of the default material and process, and those of the shipped machine of this name.
    """
    usual = _usual(profile)
    changed, every = [], []
    for section in SECTIONS:
        before = {key: value for key, value, _ in rows(section, usual[section])}
        for key, value, meaning in rows(section, getattr(profile, section)):
            every.append([label_of(key), _text(value), meaning, key])
            if key not in before or before[key] != value:
                changed.append([label_of(key), _text(value), _text(before[key]) if key in before else ""])
    for part in profile.parts:
        shared = profile.process.model_dump(mode="json")
        name = f"part {part.part}: "
        changed += [[name + label_of(f"process.{key}"), _text(value), _text(shared[key])] for key, value in part.process.items()]
    notes = [] if changed else ["all settings have their default values"]
    return [
        _table("Settings changed", ["setting", "value", "default"], changed, notes),
        _table("All settings", ["setting", "value", "meaning", "key"], every, folded=True),
    ]


def _usual(profile: Profile) -> dict[str, Frozen]:
    usual: dict[str, Frozen] = {}
    for kind, sections in OF_KIND.items():
        models = load_one(_shipped_machine(profile.machine.name) if kind == "machine" else DEFAULTS[kind])
        usual |= {section: models[section] for section in sections}
    spans = {"bridge_longest_mm": profile.material.bridge_longest_mm}  # the material determines it unless the process does
    return usual | {"process": usual["process"].model_copy(update=spans)}


def _shipped_machine(name: str) -> str:
    """Name of the shipped profile of the machine with this name, else of the default one."""
    for file in shipped("machine"):
        try:
            if getattr(load_one(file)["machine"], "name", None) == name:
                return file
        except ProfileError:  # the user's own profile of the same name is invalid, which does not matter here
            continue
    return DEFAULTS["machine"]


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
