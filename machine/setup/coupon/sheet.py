"""Sheet: the TOML file that says which bar of a coupon is which, and in which a person notes at what loads they broke."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import tomlkit

from machine.setup.coupon.bars import SHAPES, Shape
from machine.setup.coupon.design import JOINTS, KINDS, MOST_FACTORS, Factor, signs
from machine.setup.sheet_file import check_row, quoted, read_document, rows_of
from profiles.errors import ProfileError

KEYS = ("coupon", "machine", "material", "process", "bar", "factor")
MOST_MPA = 300.0  # no filament bears more; a larger number is misread
IN_WORDS = {"joint": "jointed", "z": "in one piece, upright", "x": "in one piece, lying"}
PULLED = {"bend": "across its axis, at the notch", "tensile": "along its axis"}


@dataclass(frozen=True)
class Sheet:
    """A coupon's shape, the profiles it was printed with, the factors of its jointed bars, and by number the loads in N at which
    each bar broke: one for each time that the plate was printed, nan where it is not told.
    """

    shape: Shape
    machine: str
    material: str
    process: str
    factors: tuple[Factor, ...]
    loads_n: tuple[tuple[float, ...], ...]


def empty_sheet(shape: Shape, names: Sequence[str], factors: Sequence[Factor]) -> Sheet:
    """A sheet without loads; names: of machine, material and process."""
    machine, material, process = names
    return Sheet(shape, machine, material, process, tuple(factors), tuple((float("nan"),) for _ in KINDS))


def settings_in_words(sheet: Sheet, bar: int) -> str:
    """What a bar, counted from 1, is and which of its settings are not the process's own."""
    kind = IN_WORDS[KINDS[bar - 1]]
    if bar > JOINTS:
        return kind
    row = signs(len(sheet.factors))[bar - 1]
    own = [f"{factor.key} = {factor.other}" for factor, sign in zip(sheet.factors, row, strict=True) if sign > 0]
    return f"{kind}, {', '.join(own) or 'as the process has it'}"


def sheet_text(sheet: Sheet) -> str:
    """The sheet as TOML, with what a person must know to fill it in."""
    lines = [
        f"# Coupon of {sheet.shape.name} bars. Pull each bar {PULLED[sheet.shape.name]}, until it breaks.",
        "# In the place of nan comes the load in N: kg of a luggage scale times 9.81. A bar that is left at nan is not used.",
        "# Where the plate is printed again, every bar has one more load: [82.0, 78.5].",
    ]
    for key in ("coupon", "machine", "material", "process"):
        value = sheet.shape.name if key == "coupon" else getattr(sheet, key)
        lines.append(f"{key} = {quoted(value)}")
    for factor in sheet.factors:
        lines += ["", "[[factor]]", f'key = "{factor.key}"', f"own = {_value(factor.own)}", f"other = {_value(factor.other)}"]
    for bar, loads in enumerate(sheet.loads_n, start=1):
        lines += ["", f"# {settings_in_words(sheet, bar)}", "[[bar]]", f"number = {bar}"]
        lines.append(f"loads_n = [{', '.join(map(repr, loads))}]")
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    return str(tomlkit.item(value).as_string())


def read_sheet(path: Path) -> Sheet:
    """The sheet in a file. Raises ProfileError naming the file, and the bar at fault."""
    document = read_document(path, KEYS, "a coupon's")
    shape = SHAPES.get(str(document.get("coupon")))
    if shape is None:
        raise ProfileError(f"{path}: coupon is {document.get('coupon')!r}: it must be one of {', '.join(SHAPES)}")
    machine, material, process = (_name(path, document, key) for key in ("machine", "material", "process"))
    factors = tuple(_factor(path, row) for row in rows_of(path, document, "factor"))
    loads: dict[int, tuple[float, ...]] = {}
    for row in rows_of(path, document, "bar"):
        number, told = _loads(path, shape, row)
        if number in loads:
            raise ProfileError(f"{path}: bar {number} is told twice: a plate printed again has one more load in its list")
        loads[number] = told
    if not 1 <= len(factors) <= MOST_FACTORS or len({factor.key for factor in factors}) < len(factors):
        raise ProfileError(f"{path}: {len(factors)} [[factor]] tables: 1 to {MOST_FACTORS} of different keys are expected")
    empty = (float("nan"),)
    return Sheet(shape, machine, material, process, factors, tuple(loads.get(bar, empty) for bar in range(1, len(KINDS) + 1)))


def _name(path: Path, document: Mapping[str, Any], key: str) -> str:
    name = document.get(key)
    if not isinstance(name, str) or not name:
        raise ProfileError(f"{path}: {key} is {name!r}: the name of a profile is expected")
    return name


def _factor(path: Path, row: Mapping[str, Any]) -> Factor:
    if set(row) != {"key", "own", "other"} or not isinstance(row["key"], str):
        raise ProfileError(f"{path}: a [[factor]] has {', '.join(row) or 'nothing'}: key, own and other are expected")
    return Factor(row["key"], row["own"], row["other"])


def _loads(path: Path, shape: Shape, row: Mapping[str, Any]) -> tuple[int, tuple[float, ...]]:
    number, loads = row.get("number"), row.get("loads_n")
    if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= len(KINDS):
        raise ProfileError(f"{path}: there is no bar {number!r}: the bars are 1 to {len(KINDS)}")
    check_row(path, f"bar {number}", row, ("number", "loads_n"))
    if not isinstance(loads, list) or not all(isinstance(load, int | float) and not isinstance(load, bool) for load in loads):
        raise ProfileError(f"{path}: bar {number}: loads_n is {loads!r}: it must be a list of numbers")
    for load in loads:
        problem = "" if isnan(load) else load_problem(shape, load)
        if problem:
            raise ProfileError(f"{path}: bar {number}: {problem}")
    return number, tuple(map(float, loads))


def load_problem(shape: Shape, load_n: float) -> str:
    """Why a number cannot be the load at which a bar broke; "": it can."""
    most_n = MOST_MPA / shape.strength_mpa(1.0)
    if isfinite(load_n) and 0.0 < load_n <= most_n:
        return ""
    return f"a load of {load_n:g} N cannot be: above 0 and up to {most_n:.0f} N ({MOST_MPA:g} MPa) is allowed"
