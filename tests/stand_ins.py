"""Stand-ins for what the examples of the pages need: a printer at a port, print servers, a user's hand, filled-in sheets."""

import re
import subprocess
from contextlib import ExitStack
from io import StringIO
from pathlib import Path
from typing import Any

import manifold3d as m3
import numpy as np
import pytest

from machine.cli.cli import main
from machine.printing import ports
from machine.printing.servers import follow
from machine.printing.servers.http import VARIABLE
from machine.setup.calibration.program import plan_touches
from machine.simulator.contact import ProbedTable, TrueBall
from machine.simulator.faults import Fault
from machine.simulator.simulator import SimulatedPrinter
from profiles.places import shipped
from profiles.profile import load
from tests.machine.cli.commands.test_profiles_detect import TellingDuet, TellingKlipper
from tests.machine.cli.commands.test_slicer_files import settings_of
from tests.machine.peers import hear_out
from tests.machine.printing.servers.stand_ins import KEY, OctoPrintStandIn, stand_in
from tests.machine.setup.calibration.steady_hand import put_hand_on
from tests.mdp.slicer_files import Made, Object, Placed, bambu

PORT = "/dev/ttyACM0"
SERVER = re.compile(r"(octoprint|moonraker|duet):[\w.]+")
NEWTONS = 80.0
POWER_CUT_LINE = 1000


class Terminal(StringIO):
    """A terminal at which a user types these lines."""

    def isatty(self) -> bool:
        return True


class DuetWithUAndV(TellingDuet):
    """A Duet whose rotary axes are U and V."""

    def _model(self, key: str) -> Any:
        found = super()._model(key)
        letters = {"A": "U", "C": "V"}
        return [axis | {"letter": letters.get(axis["letter"], axis["letter"])} for axis in found] if key == "move.axes" else found


HANDLERS = {"octoprint": OctoPrintStandIn, "moonraker": TellingKlipper, "duet": DuetWithUAndV}


def set_up(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """A key for servers, a browser that opens nothing, files of another slicer and of a certificate."""
    monkeypatch.setattr(follow, "POLL_S", 0.02)
    monkeypatch.setenv(VARIABLE, KEY)
    monkeypatch.setenv("BROWSER", "true")
    hear_out(monkeypatch, ports)
    post = m3.Manifold.cube((8.0, 10.0, 12.0), True).translate((0.0, 0.0, 6.0))
    plates = [Object([Made(post)], [Placed(np.vstack([np.eye(3), [300.0 * k, 0.0, 0.0]]), k + 1)]) for k in range(2)]
    bambu(folder / "model.3mf", plates, np.random.default_rng(0), settings_of("OrcaSlicer"))
    certificate(folder)


def certificate(folder: Path) -> None:
    """Write my.pem and my.key."""
    key = ("-newkey", "rsa:2048", "-nodes", "-keyout", "my.key", "-out", "my.pem", "-days", "2", "-subj", "/CN=workshop")
    subprocess.run(["openssl", "req", "-x509", *key], cwd=folder, check=True, capture_output=True)


def at_stand_ins(line: str, monkeypatch: pytest.MonkeyPatch, until_end: ExitStack) -> str:
    """A line of a page with the addresses of stand-ins, which run until the end."""
    if PORT in line or line.startswith("tiltprint ports"):
        named = re.search(r"--machine (\w+)(?: |$)", line)
        machine = load(named[1] if named and named[1] in shipped("machine") else "generic_ac").machine
        radius_mm = min(0.6 * machine.table.radius_mm, 45.0)
        table = ProbedTable(machine, TrueBall(10.0, (radius_mm, 0.0, 45.0)), noise_mm=0.005, flat_mm=0.5)
        cut = [Fault("reset", at=POWER_CUT_LINE, unit="line")] if "JOURNAL" in line else []
        path = until_end.enter_context(SimulatedPrinter(machine, table=table, faults=cut)).path
        if cut:
            assert main(["export", "model.stl", "-o", "model.gcode"]) == 0
            assert main(["print", "model.gcode", "--port", path, "--journal", "JOURNAL"]) == 1
        monkeypatch.setattr(ports, "serial_devices", lambda: (ports.SerialDevice(path, path, "", ""),))
        line = line.replace(PORT, path)
    if (mark := re.search(r"--machine (\S+) --mark-height (\d+) --port", line)) is not None:
        machine = load(mark[1]).machine
        put_hand_on(monkeypatch, machine, plan_touches(machine, float(mark[2])).mark_mm)
    if (server := SERVER.search(line)) is not None:
        steppers = {"steppers": ("stepper_a", "stepper_b", "stepper_c")}
        job, address = until_end.enter_context(stand_in(server[1], handler=HANDLERS[server[1]], **steppers))
        if line.startswith("tiltprint follow"):
            job.files["vase.gcode"] = bytes(100)
            job.start("vase.gcode")
        line = line.replace(server[0], address)
    return line


def fill_in(sheet: Path) -> None:
    """Write into a sheet what a perfect machine, or equally strong bars, would show."""
    text = sheet.read_text(encoding="utf-8")
    near = re.compile(r"(near ([-\d.]+) ([-\d.]+) ([-\d.]+)\n.*?xyz_mm = )\[nan, nan, nan\]", re.DOTALL)
    text = near.sub(r"\1[\2, \3, \4]", text)
    sheet.write_text(text.replace("loads_n = [nan]", f"loads_n = [{NEWTONS}]"), encoding="utf-8")
