"""Line outcome: whether the line that was on its way when the port was lost has been done, by where the printer stands.

For firmwares that never ask for a line again: RepRapFirmware and Klipper cannot be asked by line number, but both report the
place they were sent to, to a thousandth, and the filament with it.
"""

from collections.abc import Mapping, Sequence

from machine.gcode.commands import command_in
from machine.gcode.modes import E_AXIS, ModalState
from machine.link.status import PrinterStatus

SAME = 0.01  # mm or deg: what program and firmware round
DISTINCT = 0.004  # two places nearer to each other cannot be told apart by thousandths
SEVERAL = 3  # coordinates that are not 0 and agree: a printer that has restarted stands at 0 0 0


def line_was_done(command: str, before: Sequence[float | None], after: ModalState, status: PrinterStatus) -> bool | None:
    """True: done; False: it may be sent once more; None: nobody can say, or the printer has restarted.

    before: X Y Z tilt turn E before the command; after: what the firmware is to remember after it.
    """
    if status.position is None or len(before) <= E_AXIS:
        return None
    reported = dict(status.position.axes)
    letters = [
        letter
        for letter, old, new in zip(after.axes.letters, before, after.at, strict=True)
        if letter in reported and old is not None and new is not None
    ]
    start, end = (dict(zip(after.axes.letters, values, strict=True)) for values in (before, after.at))
    if not _still_running(reported, (start, end), letters, status, after):
        return None
    for chosen in ([letter for letter in letters if letter != "E"], letters):  # some firmwares count filament in their own way
        if _greatest_difference(start, end, chosen) >= DISTINCT:
            return _reached_end(reported, start, end, chosen)
    row = command_in(command)
    absolute = not (after.modes.relative or after.modes.filament_relative)
    repeatable = row.repeatable or row.modal or (row.moves == "path" and absolute)
    return False if repeatable and _greatest_difference(reported, end, letters) <= SAME else None


def _still_running(
    reported: Mapping[str, float],
    ends: Sequence[Mapping[str, float | None]],
    letters: Sequence[str],
    status: PrinterStatus,
    after: ModalState,
) -> bool:
    """Whether the printer has not restarted since: it stands at one of the places, and still heats what is to be hot."""
    heat = status.temperature
    pairs = ((after.nozzle_c, heat.nozzle_target_c), (after.bed_c, heat.bed_target_c))
    if any(wanted > 0 and target is not None and target <= 0 for wanted, target in pairs):
        return False
    at = [letter for letter in letters if letter != "E"]
    stands = any(_greatest_difference(reported, end, at) <= SAME for end in ends)
    hot = any(wanted > 0 and target for wanted, target in pairs)
    return stands and (hot or sum(abs(reported[letter]) > SAME for letter in letters) >= SEVERAL)


def _reached_end(
    reported: Mapping[str, float], start: Mapping[str, float | None], end: Mapping[str, float | None], letters: Sequence[str]
) -> bool | None:
    """Whether the printer stands where the command leads to; None when at neither place."""
    from_start = _greatest_difference(reported, start, letters)
    from_end = _greatest_difference(reported, end, letters)
    return from_end < from_start if min(from_start, from_end) <= SAME else None


def _greatest_difference(a: Mapping[str, float | None], b: Mapping[str, float | None], letters: Sequence[str]) -> float:
    """The greatest difference of two places on some axes."""
    return max((abs((a[letter] or 0.0) - (b[letter] or 0.0)) for letter in letters), default=0.0)


def position_differences(modal: ModalState, reported: tuple[tuple[str, float], ...], near: float) -> list[str]:
    """Axes on which the printer's own position differs by more than `near` from what the program has led to, in words."""
    coordinates = dict(reported)
    pairs = zip(modal.axes.letters[:E_AXIS], modal.at[:E_AXIS], strict=True)
    return [
        f"{letter} {coordinates[letter]:g} instead of {value:.3f}"
        for letter, value in pairs
        if value is not None and letter in coordinates and abs(coordinates[letter] - value) > near
    ]
