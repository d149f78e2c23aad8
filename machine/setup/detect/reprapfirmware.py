"""RepRapFirmware 3: config.g, or its object model as M409 and rr_model answer it, a line of JSON for each key.

Platform/Platform.cpp, Heating/Heat.cpp and Heater.cpp (fc1cd16c): speed and jerk of an axis are per minute, acceleration per
second squared; heat.bedHeaters and a tool's heaters are indices into heat.heaters, whose max is the greatest temperature.
"""

import json
import re
from collections.abc import Mapping
from typing import Any

from machine.printing.servers.http import number, table
from machine.setup.detect.config_g import read_commands
from machine.setup.detect.duet_board import MINUTE_S, DuetBoard
from machine.setup.detect.found import ACCELERATION, LIMITS, SPEED, AxisReadings, ConfigText, Found, Reading, limits
from profiles.errors import ProfileError

OWN = re.compile(r"^\s*M(?:566|584|574|950|563|143|669)\b", re.MULTILINE)  # commands that no other firmware has
MODEL = re.compile(r'^\s*\{"key":\s*"', re.MULTILINE)

Table = Mapping[str, Any]


def recognise(text: str) -> bool:
    """Whether a text is a config.g, or answers to M409."""
    return MODEL.search(text) is not None or (OWN.search(text) is not None and "echo:" not in text)


def read(config: ConfigText) -> Found:
    """What either says. Raises ProfileError."""
    return _read_model(config) if MODEL.search(config.text) else read_commands(config)


def _read_model(config: ConfigText) -> Found:
    model = _model(config)
    board = DuetBoard()
    for axis in _tables(model.get("move.axes")):
        letter = str(axis.get("letter") or "")
        source = f"move.axes, {letter}"
        board.axes[letter] = _drive(axis, source)
        low, high, jerk = (number(axis.get(key)) for key in ("min", "max", "jerk"))
        if low is not None and high is not None:
            board.axes[letter][LIMITS] = limits(f"{config.name}: axis {letter}", low, high, source)
        if jerk is not None:
            board.jerks_mm_s[letter] = jerk / MINUTE_S
    for extruder in _tables(model.get("move.extruders"))[:1]:
        board.axes["E"] = _drive(extruder, "move.extruders")
    _take_heat(board, table(model.get("heat")), _tables(model.get("tools")))
    probes = _tables(model.get("sensors.probes"))
    board.probe = int(number(probes[0].get("type")) or 0) if probes else 0
    main, network = table(model.get("boards[0]")), table(model.get("network"))
    board.name = str(network.get("name") or "")
    kinematics = table(model.get("move.kinematics")).get("name") or board.kinematics
    board.kinematics = str(kinematics).lower().replace(" ", "")
    board.firmware = f"{main.get('firmwareName') or board.firmware} {main.get('firmwareVersion') or ''}".strip()
    return board.found(config.name, "move.kinematics", "move.axes, jerk", "heat.heaters, max")


def _take_heat(board: DuetBoard, heat: Table, tools: list[Table]) -> None:
    heaters = heat.get("heaters")
    limits_c = [number(table(heater).get("max")) for heater in (heaters if isinstance(heaters, list) else [])]  # some are null
    board.heaters_c = {index: limit for index, limit in enumerate(limits_c) if limit is not None}
    board.bed = _first(heat.get("bedHeaters"), -1)
    board.nozzle = _first(tools[0].get("heaters") if tools else None, board.nozzle)


def _model(config: ConfigText) -> dict[str, Any]:
    """Key -> its value; the pages of an array are joined."""
    model: dict[str, Any] = {}
    for line in config.text.split("\n"):
        if not MODEL.match(line):
            continue
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            raise ProfileError(f"{config.name}: an answer to M409 is cut off or damaged") from None
        key, value = str(table(answer).get("key")), table(answer).get("result")
        paged = isinstance(model.get(key), list) and isinstance(value, list)
        model[key] = model[key] + value if paged else value
    return model


def _drive(drive: Table, source: str) -> AxisReadings:
    told = ((key, number(drive.get(key)), unit_s) for key, unit_s in ((SPEED, MINUTE_S), (ACCELERATION, 1.0)))
    return {key: Reading(value / unit_s, source) for key, value, unit_s in told if value is not None}


def _tables(value: Any) -> list[Table]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list) else []


def _first(values: Any, otherwise: int) -> int:
    return values[0] if isinstance(values, list) and values and isinstance(values[0], int) else otherwise
