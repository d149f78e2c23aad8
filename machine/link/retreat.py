"""Retreat: the commands that take the tip away from the print, and back to the very place where it stopped.

Away: filament pulled back, straight up along the nozzle, aside. Back: heat, the same way in reverse, filament pushed, and
everything the firmware is to remember. The rotary axes never move.
"""

from dataclasses import dataclass

import numpy as np

from machine.dialects import DIALECTS
from machine.link.modal import E_AXIS, Modal
from machine.link.park import Laid, Park, moves, parked, standing_mm
from machine.pen import number
from profiles.profile import Profile

PULL_MM, PULL_MM_S = 1.0, 30.0  # where no material tells
SLOWLY = 0.25  # the last stretch down goes at this share of the Z axis' speed
NEAR_MM = 2.0


@dataclass(frozen=True)
class Retreat:
    """Commands away and back. park: None where the tip stays because its place is not known or no way is clear."""

    away: tuple[str, ...]
    back: tuple[str, ...]
    park: Park | None


def retreat(modal: Modal, profile: Profile | None, laid: Laid | None) -> Retreat:
    """How to leave a print that stands at modal's place, all moves over, and how to come back."""
    pull, push = pushing(modal, profile)
    up, down, park = _ways(modal, profile, laid)
    away = ["G21", *pull, "G90", *up]
    standby_c = profile.material.standby_c if profile is not None else None
    if standby_c is not None and profile is not None and pull and standby_c < modal.nozzle_c:
        away.append(DIALECTS[profile.machine.dialect].nozzle.format(number(standby_c)))
    back = [*heated(modal, profile), "G21", "G90", *down, *push, *modal.lines()]
    return Retreat(tuple(away), tuple(back), park)


def heated(modal: Modal, profile: Profile | None) -> list[str]:
    """Wait for the temperatures the program wants: the bed first, it takes longest and the print stands on it."""
    wait = DIALECTS[profile.machine.dialect].nozzle_wait if profile is not None else "M109 S{}"
    bed = [f"M190 S{number(modal.bed_c)}"] if modal.bed_c > 0 else []
    return bed + ([wait.format(number(modal.nozzle_c))] if modal.nozzle_c > 0 else [])


def pushing(modal: Modal, profile: Profile | None) -> tuple[list[str], list[str]]:
    """Commands that pull filament back before the tip leaves a place where it stood still, and that push it after."""
    pull, speed, extra = _filament(modal, profile)
    if not modal.nozzle_c or not pull:
        return [], []
    feed = f"F{60 * speed:.0f}"
    return ["M83", f"G1 E-{pull:.5f} {feed}"], ["M83", f"G1 E{pull + extra:.5f} {feed}"]


def _filament(modal: Modal, profile: Profile | None) -> tuple[float, float, float]:
    """How much to pull back (what the program has pulled already counts), mm, how fast, mm/s, and how much more to push."""
    material = profile.material if profile is not None else None
    whole = material.retract_mm if material is not None else PULL_MM
    speed = material.retract_speed_mm_s if material is not None else PULL_MM_S
    pull = max(0.0, whole - modal.pulled_mm)
    return pull, speed, material.prime_extra_mm if material is not None else 0.0


def _ways(modal: Modal, profile: Profile | None, laid: Laid | None) -> tuple[list[str], list[str], Park | None]:
    if profile is None or laid is None:
        return [], [], None
    machine, following = profile.machine, modal.follows
    found = standing_mm(machine, modal.place(), following)
    if found is None:
        return [], [], None
    at, pose = found
    park = parked(machine, laid.printed(following), at, pose)
    if park is None:
        return [], [], None
    rise, across = 60.0 * machine.z.speed_mm_s, 60.0 * profile.process.travel_speed_mm_s
    speeds = [rise, across]
    up = [f"G0 {words} F{feed:.0f}" for words, feed in zip(moves(machine, park, pose, following), speeds, strict=False)]
    above = np.array([at[0], at[1], min(at[2] + NEAR_MM, park.lift_mm[2])])
    near, home = Park(tuple(above), tuple(above)), Park(tuple(at), tuple(at))
    over = [f"G0 {_words(park.lift_mm)} F{across:.0f}"] if not following else []
    if following:
        over = [f"G0 {moves(machine, Park(park.lift_mm, park.lift_mm), pose, True)[0]} F{across:.0f}"]
    down = [
        *over,
        f"G0 {moves(machine, near, pose, following)[0]} F{rise:.0f}",
        f"G1 {moves(machine, home, pose, following)[0]} F{SLOWLY * rise:.0f}",
    ]
    return up, down, park


def _words(place: tuple[float, float, float]) -> str:
    return f"X{place[0]:.3f} Y{place[1]:.3f}"


def unlike(modal: Modal, told: tuple[tuple[str, float], ...], near: float, filament: bool = False) -> list[str]:
    """Axes on which the printer's own position differs by more than `near` from what the program has led to, in words."""
    places = dict(told)
    last = E_AXIS + 1 if filament else E_AXIS
    pairs = zip(modal.axes.letters[:last], modal.at[:last], strict=True)
    return [
        f"{letter} {places[letter]:g} instead of {value:.3f}"
        for letter, value in pairs
        if value is not None and letter in places and abs(places[letter] - value) > near
    ]
