"""Design: the settings of each jointed bar, and the sheet for the loads at which the bars broke.

Two levels of each factor are balanced over eight bars, a fraction of the two-level factorial (Box, Hunter, Hunter, Statistics for
Experimenters): three factors in all combinations, the fourth equal to their product, the fifth to the product of the first two.
With four factors no main effect is confounded with an interaction of two; the fifth is confounded with that of the first two.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import tomlkit

from machine.setup.coupon.bars import SHAPES, Shape
from machine.setup.files import check_row, quoted, read_document, rows_of
from profiles.errors import ProfileError
from profiles.messages import option
from profiles.part_settings import PartSettings, part_keys
from profiles.process import Process
from profiles.profile import Profile, with_part_settings
from profiles.toml_text import read_value

JOINTS = 8
KINDS = ("joint",) * JOINTS + ("z", "z", "x", "x")  # bars 1, 2, ...: jointed, in one piece upright, in one piece flat
MOST_FACTORS = 5
# Key of the process and its values to try: the first that differs from the process's own.
USUAL: dict[str, tuple[Any, ...]] = {
    "interface_overlap": (0.75, 0.5),
    "interface_flow": (1.15, 1.05),
    "interface_temperature_add_c": (20.0, 5.0),
    "interface_bottom_layers": (2, 0),
}
KEYS = ("coupon", "machine", "material", "process", "bar", "factor")
MOST_MPA = 300.0  # stronger than any filament: a larger number is misread
IN_WORDS = {"joint": "jointed", "z": "in one piece, upright", "x": "in one piece, lying"}
PULLED = {"bend": "across its axis, at the notch", "tensile": "along its axis"}


@dataclass(frozen=True)
class Factor:
    """A key of the process, its value there, and the other value, which half of the bars have."""

    key: str
    own: Any
    other: Any


def factors(profile: Profile, given: Sequence[str] = ()) -> tuple[Factor, ...]:
    """The factors of USUAL, or of KEY=VALUE texts instead. Raises ProfileError for keys that cannot differ between bars."""
    process = profile.process
    if not given:
        usual = {key: next(value for value in values if value != getattr(process, key)) for key, values in USUAL.items()}
        return _checked(profile, usual)
    if len(given) > MOST_FACTORS:
        raise ProfileError(
            f"{option('vary')} is given {len(given)} times: {JOINTS} bars can distinguish at most {MOST_FACTORS} settings"
        )
    asked = {}
    for text in given:
        key, equals, value = text.partition("=")
        key = key.strip().removeprefix("process.")
        if not equals or not value.strip():
            raise ProfileError(f"{option('vary', text)}: KEY=VALUE is expected, such as interface_flow=1.15")
        if key not in part_keys():
            raise ProfileError(
                f"{option('vary', text)}: {key} cannot differ from bar to bar; interlock and `interface_` keys can"
            )
        if key in asked:
            raise ProfileError(f"{option('vary', text)}: {key} is given twice")
        asked[key] = read_value(value.strip())
    return _checked(profile, asked)


def _checked(profile: Profile, asked: dict[str, Any]) -> tuple[Factor, ...]:
    try:
        settled = with_part_settings(profile.of_all_parts, [PartSettings(part=2, process=asked)]).of_part(2).process
    except ProfileError as error:
        raise ProfileError(f"{error}".replace("part 2: ", f"{option('vary')}: ")) from None
    found = tuple(Factor(key, getattr(profile.process, key), getattr(settled, key)) for key in asked)
    alike = next((factor for factor in found if factor.own == factor.other), None)
    if alike is not None:
        raise ProfileError(
            f"{option('vary', f'{alike.key}={alike.other}')}: the process has that value itself, so the bars would be alike"
        )
    _check_heat(profile, settled)
    return found


def _check_heat(profile: Profile, hottest: Process) -> None:
    machine = profile.machine
    nozzle_c = profile.material.nozzle_c + hottest.interface_temperature_add_c
    if nozzle_c > machine.nozzle_limit_c:
        raise ProfileError(
            f"a bar would be printed at {nozzle_c:g} °C: {machine.name} allows at most {machine.nozzle_limit_c:g} °C; "
            f"{option('vary')} interface_temperature_add_c=... with less"
        )


def signs(count: int) -> list[tuple[int, ...]]:
    """(JOINTS) rows of levels of `count` factors, -1: the process's value, 1: the other one.

    In the first four rows and in the last four each factor has both levels equally often, so that a bar's place cancels out.

    >>> [sum(column) for column in zip(*signs(5))]
    [0, 0, 0, 0, 0]
    """
    runs = sorted(product((-1, 1), repeat=3), key=lambda run: run[1] * run[2])
    return [(a, b, c, a * b * c, a * b)[:count] for a, b, c in runs]


def settings_of_bars(chosen: Sequence[Factor]) -> list[dict[str, Any]]:
    """Settings of each jointed bar that differ from the process."""
    return [
        {factor.key: factor.other for factor, sign in zip(chosen, row, strict=True) if sign > 0} for row in signs(len(chosen))
    ]


@dataclass(frozen=True)
class Sheet:
    """Results of a coupon: its shape, profiles and factors, and the loads in N at which the bars broke. loads_n: for each bar one
    load per printed plate, nan if unknown."""

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
    """Kind of a bar, counted from 1, and its settings that differ from the process."""
    kind = IN_WORDS[KINDS[bar - 1]]
    if bar > JOINTS:
        return kind
    row = signs(len(sheet.factors))[bar - 1]
    own = [f"{factor.key} = {factor.other}" for factor, sign in zip(sheet.factors, row, strict=True) if sign > 0]
    return f"{kind}, {', '.join(own) or 'as the process has it'}"


def sheet_text(sheet: Sheet) -> str:
    """The sheet as TOML, with instructions."""
    lines = [
        f"# Coupon of {sheet.shape.name} bars. Pull each bar {PULLED[sheet.shape.name]}, until it breaks.",
        "# Replace nan by the load in N: kg of a luggage scale times 9.81. A bar that stays nan is not used.",
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
    """The sheet in a file. Raises ProfileError naming the file and the faulty bar."""
    document = read_document(path, KEYS, "a coupon's")
    shape = SHAPES.get(str(document.get("coupon")))
    if shape is None:
        raise ProfileError(f"{path}: coupon is {document.get('coupon')!r}: it must be one of {', '.join(SHAPES)}")
    machine, material, process = (_name(path, document, key) for key in ("machine", "material", "process"))
    factors = tuple(_factor(path, row) for row in rows_of(path, document, "factor"))
    loads: dict[int, tuple[float, ...]] = {}
    for row in rows_of(path, document, "bar"):
        number, loads_n = _loads(path, shape, row)
        if number in loads:
            raise ProfileError(f"{path}: bar {number} appears twice: a plate printed again has one more load in its list")
        loads[number] = loads_n
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
    """Why a number cannot be a load at which a bar broke; "" if it can."""
    most_n = MOST_MPA / shape.strength_mpa(1.0)
    if isfinite(load_n) and 0.0 < load_n <= most_n:
        return ""
    return f"a load of {load_n:g} N cannot be: above 0 and up to {most_n:.0f} N ({MOST_MPA:g} MPa) is allowed"
