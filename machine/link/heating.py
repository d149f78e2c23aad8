"""What the commands of heaters, fan and power supply do in a simulated printer."""

from collections.abc import Iterator
from math import inf

from machine.dialects import DIALECTS
from machine.link.body import Body, Command, Words, Work

NEAR_C = 1.0  # Marlin's TEMP_WINDOW: a heater within it has arrived
TALK_S = 1.0  # Marlin tells temperatures so often while it waits for heat


def heat(body: Body, words: Words, text: str) -> Work:
    """Give a heater its target: M104, M109, M568 the nozzle, others the bed."""
    heater = body.nozzle if text.startswith(("M104", "M109", "M568")) else body.bed
    wanted = words.get("S", words.get("R"))
    if wanted is not None and body.powered:
        heater.set(wanted, body.now_s)
        body.note(f"{heater.name} {heater.target_c:g}")
    return None


def heat_and_wait(body: Body, words: Words, text: str) -> Iterator[float]:
    """The same, and wait until it is there; R: also for a hotter one to cool."""
    heat(body, words, text)
    heater = body.nozzle if text.startswith("M109") else body.bed
    rising = heater.target_c > heater.at(body.now_s)
    if not rising and "R" not in words:
        return
    arrived_s = heater.reaches(heater.target_c - NEAR_C if rising else heater.target_c + NEAR_C)
    if arrived_s == inf and heater.trip_s == inf:
        return
    body.waits_for_heat, body.impatient = True, False
    while body.now_s < arrived_s and not body.impatient:
        yield min(arrived_s, body.now_s + TALK_S)
        body.say(body.temperatures() if body.manner.talks_in_ok else f"{body.temperatures()} W:?")
    body.waits_for_heat = False


def _wait_for_all(body: Body, words: Words, text: str) -> Iterator[float]:
    """M116 (RepRapFirmware)."""
    yield from heat_and_wait(body, {"S": body.bed.target_c}, "M190")
    yield from heat_and_wait(body, {"S": body.nozzle.target_c}, "M109")


def _fan(body: Body, words: Words, text: str) -> Work:
    full = 1.0 if words.get("S", 255.0) <= DIALECTS[body.machine.dialect].fan_full == 1 else 255.0
    body.fan = min(max(words.get("S", full), 0.0), full) / full if text.startswith("M106") else 0.0
    body.note(f"fan {body.fan:.2f}")
    return None


def _allow_cold(body: Body, words: Words, text: str) -> Work:
    """M302."""
    if "P" in words:
        body.cold_allowed = words["P"] != 0
    elif "S" in words:
        body.cold_allowed = words["S"] <= 0
    return None


def _hurry(body: Body, words: Words, text: str) -> Work:
    body.impatient = True
    return None


def _power(body: Body, words: Words, text: str) -> Work:
    """M80, M81: without the power supply nothing heats; what moves is planned and does not matter."""
    if text.startswith("M81"):
        body.off()
    body.powered = not text.startswith("M81")
    body.note(f"power {'on' if body.powered else 'off'}")
    return None


HEATING: dict[str, Command] = {
    "M80": _power,
    "M81": _power,
    "M104": heat,
    "M106": _fan,
    "M107": _fan,
    "M108": _hurry,
    "M109": heat_and_wait,
    "M116": _wait_for_all,
    "M140": heat,
    "M190": heat_and_wait,
    "M302": _allow_cold,
    "M568": heat,
}
