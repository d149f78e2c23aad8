"""Report: what stands beside the picture: figures of the print, its parts, its kinds of line, its rivals.

All values are texts ready to show, so that the page has nothing to work out.
"""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.app.compare import Rival
from machine.app.pipeline import Program
from machine.app.report import duration, risky_before_mm2
from machine.app.view.layers import Layers
from machine.app.view.paths import PRIME, WIPE, page_kinds
from machine.app.view.settings import settings_tables
from machine.dryrun.dryrun import DryRun, summary
from machine.parsed import MoveKind
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats
from mdp.orientation import best_orientation, in_words
from profiles.profile import Profile

Table = dict[str, Any]
Row = list[str]
MOVES = {
    MoveKind.TRAVEL: "travel", MoveKind.RETRACT: "retraction", PRIME: "prime", WIPE: "wipe", MoveKind.ROTATE: "turning the table",
}  # fmt: skip
UNTOLD = "not told"
RISKY = "risky: faces that would need support if the model were printed straight up; left: as the part is printed"


def parts_report(decomposition: Decomposition, profile: Profile) -> dict[str, Any]:
    """The report of a page of parts alone."""
    facts = [["parts", str(len(decomposition.parts))], ["volume", _cm3(decomposition.volume_mm3)], *_names(profile)]
    rows = [_solid(part, profile) for part in decomposition.parts]
    tables = [_table("Parts", SOLID, rows, [RISKY]), _areas(decomposition, profile), *settings_tables(profile)]
    return {"facts": facts, "tables": tables}


def print_report(
    program: Program,
    profile: Profile,
    layers: Layers,
    ends_s: Floats,
    rivals: Sequence[Rival] = (),
    known: bool = True,
    ours: bool = True,
) -> dict[str, Any]:
    """The report of a whole print. ends_s: (n,) when each row ends; rivals: the same model printed in one part.

    known: the machine is no guess; ours: the file was made with this profile, else its settings are not told.
    """
    tables = [_parts(program, profile, layers, ends_s), _kinds(program.run, profile, "" if known else profile.machine.name)]
    if program.decomposition is not None:
        tables.append(_rivals(rivals) if rivals else _areas(program.decomposition, profile))
    names = _names(profile) if ours else _guessed(profile, known)
    facts = [*_figures(program.run, profile, layers), *names]
    return {"facts": facts, "tables": tables + (settings_tables(profile) if ours else [])}


def _table(title: str, head: Row, rows: list[Row], notes: Sequence[str] = (), folded: bool = False) -> Table:
    return {"title": title, "head": head, "rows": rows, "notes": list(notes), "folded": folded}


SOLID = ["part", "tilt", "turn", "cm³", "risky mm²", "left mm²"]


def _solid(part: Part, profile: Profile) -> Row:
    """A part's shape: pose, volume, and the faces that would and will need support."""
    before = risky_before_mm2(part, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces)
    angles = [f"{part.pose.tilt_deg:.1f}°", f"{part.pose.turn_deg:.1f}°"]
    areas = [f"{max(area, 0.0):.1f}" for area in (before, part.risky_area_mm2)]
    return [str(part.index), *angles, f"{part.volume_mm3 / 1000.0:.2f}", *areas]


def _parts(program: Program, profile: Profile, layers: Layers, ends_s: Floats) -> Table:
    """Each part with its layers, time and material; what its solid is where the program came from a model."""
    parsed, seconds = program.run.program, np.diff(ends_s, prepend=0.0)
    found = program.decomposition
    solids = {part.index: _solid(part, profile) for part in found.parts} if found is not None else {}
    rows = []
    for index in parsed.parts or (0,):
        mine = parsed.part == index
        count = int((parsed.part[layers.first] == index).sum())
        made = [str(count), duration(float(seconds[mine].sum())), f"{_grams(parsed.e_mm[mine], profile):.1f}"]
        rows.append([*solids.get(index, [str(index) if index else "all"]), *made])
    head = SOLID if solids else SOLID[:1]
    return _table("Parts", [*head, "layers", "time", "g"], rows, [RISKY] if solids else [])


def _kinds(run: DryRun, profile: Profile, guess: str) -> Table:
    """Time and material by what is printed, then the ways between, then waiting; they add up to the whole print.

    guess: name of the machine whose speeds were taken where the file tells none.
    """
    program, kind = run.program, page_kinds(run.program)
    groups: list[tuple[str, NDArray[np.bool_]]] = [
        (name or UNTOLD, (kind == MoveKind.EXTRUDE) & (program.type == place)) for place, name in enumerate(program.types)
    ]
    groups += [(name, kind == number) for number, name in MOVES.items()]
    told = [(name, float(run.times_s[rows].sum()), float(program.e_mm[rows].sum())) for name, rows in groups if rows.any()]
    if run.dwell_s > 0:
        told.append(("waiting", run.dwell_s, 0.0))
    rows = [[name, duration(s), _share(s, run.time_s), _fixed(e / 1000, 2), _fixed(_grams(e, profile), 1)] for name, s, e in told]
    notes = ["heating and homing are not counted", *([f"times as on {guess}"] if guess else [])]
    return _table("Time and material", ["kind", "time", "share", "m", "g"], rows, notes)


def _areas(decomposition: Decomposition, profile: Profile) -> Table:
    """Risky area straight up, in the best single orientation, in parts."""
    best = best_orientation(decomposition.mesh, profile.process.self_supporting_angle_deg)
    single = best.risky_mm2 + (best.base_mm2 if profile.search.count_platform_faces else 0.0)
    told = [
        ("straight up", decomposition.risky_area_mm2),
        ("best single orientation", single),
        (f"in {len(decomposition.parts)} part{'s' * (len(decomposition.parts) != 1)}", decomposition.residual_area_mm2),
    ]
    whole = decomposition.risky_area_mm2
    rows = [[name, f"{max(area, 0.0):.1f}", _share(whole - area, whole)] for name, area in told]
    rows[0][2] = ""
    notes = [f"best single orientation: {in_words(best)}", "--compare tells time and material too"]
    return _table("Compared", ["print", "risky mm²", "less"], rows, notes)


def _rivals(rivals: Sequence[Rival]) -> Table:
    """This print beside the model in one part: time, filament, support, risky area."""
    rows = []
    for rival in rivals:
        made = ["-"] * 4
        if rival.time_s is not None:
            filament, grams, support = rival.filament_mm or 0.0, rival.filament_g or 0.0, rival.support_mm3 or 0.0
            made = [duration(rival.time_s), f"{filament / 1000:.2f}", f"{grams:.1f}", f"{support / 1000:.2f}"]
        rows.append([rival.name, *made, f"{max(rival.risky_mm2, 0.0):.1f}"])
    notes = [f"{rival.name}: {note}" for rival in rivals for note in (rival.orientation, rival.message) if note]
    return _table("Compared", ["print", "time", "m", "g", "support cm³", "risky mm²"], rows, notes)


def _figures(run: DryRun, profile: Profile, layers: Layers) -> list[Row]:
    values = summary(run)
    found = str(len(layers.first)) if layers.by == "comments" else f"{len(layers.first)}, by their heights"
    return [
        ["time", duration(values["time_s"])],
        ["filament", f"{values['filament_mm'] / 1000:.2f} m, {_grams(run.program.e_mm, profile):.1f} g"],
        *([["parts", str(values["parts"])]] if values["parts"] else []),
        ["layers", found],
        *[[key, str(values[key])] for key in ("reorientations", "retractions")],
        ["travel", f"{values['travel_mm'] / 1000:.2f} m"],
    ]


def _names(profile: Profile) -> list[Row]:
    return [["machine", profile.machine.name], ["material", profile.material.name], ["process", profile.process.name]]


def _guessed(profile: Profile, known: bool) -> list[Row]:
    """The same of a file that does not tell them."""
    machine = profile.machine.name if known else f"{UNTOLD}: limits, clearance and the plate were not judged"
    return [["machine", machine], ["material", f"{UNTOLD}: weights as of {profile.material.name}"]]


def _grams(filament_mm: Any, profile: Profile) -> float:
    """Weight of filament that was pushed; filament_mm: a length, or the steps that make it."""
    material = profile.material
    volume_mm3 = float(np.sum(filament_mm)) * pi * material.diameter_mm**2 / 4.0
    return volume_mm3 * material.density_g_cm3 / 1000.0


def _fixed(value: float, digits: int) -> str:
    """The value with so many digits, without a sign where they are all 0."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _share(part: float, whole: float) -> str:
    return f"{_fixed(100.0 * part / whole if whole > 0 else 0.0, 1)} %"


def _cm3(volume_mm3: float) -> str:
    return f"{volume_mm3 / 1000.0:.2f} cm³"
