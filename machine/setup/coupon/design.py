"""Design: which settings each jointed bar is printed with: two levels of each factor, balanced over eight bars.

A fraction of the two-level factorial (Box, Hunter, Hunter, Statistics for Experimenters): three factors in all combinations, the
fourth where the product of the three is, the fifth where that of the first two is. With four no effect of one factor is mixed
with that of two together; a fifth one is mixed with that of the first two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from profiles.errors import ProfileError
from profiles.messages import option
from profiles.part_settings import PartSettings, part_keys
from profiles.process import Process
from profiles.profile import Profile, with_part_settings
from profiles.toml_text import read_value

JOINTS = 8
KINDS = ("joint",) * JOINTS + ("z", "z", "x", "x")  # of the bars 1, 2, ...: jointed, in one piece upright, in one piece lying
MOST_FACTORS = 5
# Key of the process and the values that are tried beside its own, the first of them that is another.
USUAL: dict[str, tuple[Any, ...]] = {
    "interface_overlap": (0.75, 0.5),
    "interface_flow": (1.15, 1.05),
    "interface_temperature_add_c": (20.0, 5.0),
    "interface_bottom_layers": (2, 0),
}


@dataclass(frozen=True)
class Factor:
    """A key of the process, the process's own value of it, and the other one that half of the bars have."""

    key: str
    own: Any
    other: Any


def factors(profile: Profile, given: Sequence[str] = ()) -> tuple[Factor, ...]:
    """Those of USUAL, or of KEY=VALUE texts in their place. Raises ProfileError for what a bar cannot have of its own."""
    process = profile.process
    if not given:
        usual = {key: next(value for value in values if value != getattr(process, key)) for key, values in USUAL.items()}
        return _checked(profile, usual)
    if len(given) > MOST_FACTORS:
        raise ProfileError(
            f"{option('vary')} is given {len(given)} times: {JOINTS} bars can tell {MOST_FACTORS} settings apart at most"
        )
    asked = {}
    for text in given:
        key, equals, value = text.partition("=")
        key = key.strip().removeprefix("process.")
        if not equals or not value.strip():
            raise ProfileError(f"{option('vary', text)}: KEY=VALUE is expected, as interface_flow=1.15")
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
    """(JOINTS) rows of levels, -1: the process's own, 1: the other one, of `count` factors; the first four rows and the last four
    have each factor at both levels equally often, so that where a bar stands counts for nothing.

    >>> [sum(column) for column in zip(*signs(5))]
    [0, 0, 0, 0, 0]
    """
    runs = sorted(product((-1, 1), repeat=3), key=lambda run: run[1] * run[2])
    return [(a, b, c, a * b * c, a * b)[:count] for a, b, c in runs]


def settings_of_bars(chosen: Sequence[Factor]) -> list[dict[str, Any]]:
    """What each jointed bar has in place of the process's own values."""
    return [
        {factor.key: factor.other for factor, sign in zip(chosen, row, strict=True) if sign > 0} for row in signs(len(chosen))
    ]
