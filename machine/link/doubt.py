"""Doubt: whether the line that was on its way when the port was lost has been done, told by where the printer stands.

For firmwares that never ask for a line again: RepRapFirmware and Klipper cannot be asked by line number, but both tell the place
they were sent to, to a thousandth, and the filament with it.
"""

from collections.abc import Mapping, Sequence

from machine.link.framing import name_of
from machine.link.inquiry import Found
from machine.link.modal import E_AXIS, KEPT, MOVES, Modal

SAME = 0.01  # mm or deg: what program and firmware round
APART = 0.004  # two places nearer to each other cannot be told apart by thousandths
SEVERAL = 3  # coordinates that are not 0 and agree: a printer that has restarted stands at 0 0 0
# Done twice in a row they leave what they leave when done once.
HARMLESS = frozenset({
    "G4", "G20", "G21", "G90", "G91", "M73", "M82", "M83", "M104", "M105", "M106", "M107", "M109", "M114", "M116", "M117", "M140",
    "M155", "M190", "M400", "M486", "M568", "SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "SET_DISPLAY_TEXT",
    "SET_PRINT_STATS_INFO", *KEPT,
})  # fmt: skip


def was_done(command: str, before: Sequence[float | None], after: Modal, found: Found) -> bool | None:
    """True: done; False: it may be sent once more; None: nobody can say, or the printer has restarted.

    before: X Y Z tilt turn E before the command; after: what the firmware is to remember after it.
    """
    if found.position is None or len(before) <= E_AXIS:
        return None
    told = dict(found.position.axes)
    letters = [
        letter
        for letter, old, new in zip(after.axes.letters, before, after.at, strict=True)
        if letter in told and old is not None and new is not None
    ]
    was, now = (dict(zip(after.axes.letters, place, strict=True)) for place in (before, after.at))
    if not _lives(told, (was, now), letters, found, after):
        return None
    for chosen in ([letter for letter in letters if letter != "E"], letters):  # some firmwares count filament in their own way
        if _far(was, now, chosen) >= APART:
            return _nearer(told, was, now, chosen)
    again = name_of(command) in HARMLESS or (name_of(command) in MOVES and not (after.relative or after.filament_relative))
    return False if again and _far(told, now, letters) <= SAME else None


def _lives(
    told: Mapping[str, float],
    places: Sequence[Mapping[str, float | None]],
    letters: Sequence[str],
    found: Found,
    after: Modal,
) -> bool:
    """Whether the printer has not restarted since: it stands at one of the places, and still heats what is to be hot."""
    heat = found.temperature
    pairs = ((after.nozzle_c, heat.nozzle_target_c), (after.bed_c, heat.bed_target_c))
    if any(wanted > 0 and target is not None and target <= 0 for wanted, target in pairs):
        return False
    at = [letter for letter in letters if letter != "E"]
    stands = any(_far(told, place, at) <= SAME for place in places)
    hot = any(wanted > 0 and target for wanted, target in pairs)
    return stands and (hot or sum(abs(told[letter]) > SAME for letter in letters) >= SEVERAL)


def _nearer(
    told: Mapping[str, float], was: Mapping[str, float | None], now: Mapping[str, float | None], letters: Sequence[str]
) -> bool | None:
    """Whether the printer stands where the command leads to; None when at neither place."""
    from_old, from_new = _far(told, was, letters), _far(told, now, letters)
    return from_new < from_old if min(from_old, from_new) <= SAME else None


def _far(one: Mapping[str, float | None], other: Mapping[str, float | None], letters: Sequence[str]) -> float:
    """The greatest difference of two places on some axes."""
    return max((abs((one[letter] or 0.0) - (other[letter] or 0.0)) for letter in letters), default=0.0)
