"""Random commands in random order: the saved plan is read back unchanged, and undo leads back."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench, plan_of_bench, with_front, with_plan
from machine.workbench.bench.settings import export_command
from machine.workbench.bench.values import with_value
from machine.workbench.session.commands import obey
from machine.workbench.session.session import Session
from machine.workbench.work.models import Standing, read_model
from machine.workbench.work.worker_pool import WorkerPools
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.pose import about, unit
from mdp.save import stl
from mdp.search.plan_file import ZONE_KINDS
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.search.trial import Trial
from profiles.errors import UserError
from profiles.profile import load, with_part_settings
from tests.shapes import tee

COMMANDS = 500
SETTINGS = {
    "process.walls": ("3", "0", ""),
    "process.scale": ("1", "0.5", "2", "30", "1e9"),
    "process.rotate_deg": ("[0, 0, 0]", "[90, 0, 0]", "[12, -30, 45]", "no"),
    "search.pedestal_mm": ("0", "5"),
    "machine.gcode.start": ('"G28\\nM104 S{nozzle_c}"', '"{nobody}"'),
    "machine.gcode.resume": ('"G0 Z{clear_z_mm}"',),
    "machine.head.silhouette_mm": ("[[1.0, 2.0], [5.0, 9.0]]", "[[1.0, 2.0], [1.0, 3.0]]"),
    "machine.turn.budget_deg": ("720", ""),
    "machine.name": ('"mine = \\"#1\\""',),
}
NAMES = {"machine": ("generic_ac", "open5x_jubilee", "none"), "process": ("standard", "fine"), "material": ("pla", "petg")}
OF_A_PART = ("process.walls", "seam", "scale")
FRONT = [
    FrontRow(tuple(Plane(np.array([0.0, 0.6, 0.8]), 30.0 - 9.0 * cut) for cut in range(cuts)), 9.0, 5.0 * cuts, 90.0 - cuts)
    for cuts in range(3)
]


class Anything:
    """Random commands of a careless user; some make no sense."""

    def __init__(self, seed: int) -> None:
        self.any = Random(seed)
        self._ways: dict[str, Callable[[int], dict[str, Any]]] = {
            "found": lambda n: {},
            "open": lambda n: {},
            "save": lambda n: {},
            "profile file": lambda n: {},
            "undo": lambda n: {},
            "redo": lambda n: {},
            "turn": lambda n: {"axis": self.choice("xyzw"), "deg": self.choice((90, 17.3, 1e9))},
            "stand": lambda n: {"rotation": self.rotation()},
            "lay": lambda n: {"normal": [n - 2, 1, 2 * n]},
            "take": lambda n: {"parts": n},
            "lock": lambda n: {"part": n, "locked": self.choice((True, False))},
            "set_part": lambda n: {"part": n, "key": self.choice(OF_A_PART), "value": self.choice(("4", "rear", None))},
            "reset_part": lambda n: {"part": n},
            "add_stop": lambda n: {
                "kind": self.choice(("pause", "filament_change")),
                "at": self.choice((f"{n}:3", f"{n}:8.4mm", "x")),
            },
            "remove_stop": lambda n: {"number": n},
            "copies": lambda n: {"count": n},
            "add": lambda n: {**self.plane(), "after": n},
            "move": lambda n: {**self.plane(), "part": n},
            "remove": lambda n: {"part": n},
            "limb": lambda n: {"part": n, **self.choice(({}, {"point_mm": self.point(30.0)}))},
            "reorder": lambda n: {"part": n, "to": 2},
            "mark": lambda n: {"kind": self.choice(ZONE_KINDS), **self.choice(({}, {"number": n})), **self.zone()},
            "brush": lambda n: {
                "kind": self.choice(ZONE_KINDS),
                "faces": self.choice((f"{n}-{2 * n}", "0 2-3", "99999")),
                "erase": self.choice((True, False)),
            },
            "unmark": lambda n: {"kind": self.choice(ZONE_KINDS), "number": n},
            "set": lambda n: self.setting(self.choice(tuple(SETTINGS))),
            "reset": lambda n: {},
            "profile": lambda n: self.profile(self.choice(tuple(NAMES))),
        }

    def choice(self, values: Any) -> Any:
        return self.any.choice(values)

    def command(self) -> dict[str, Any]:
        name = self.choice(tuple(self._ways))
        return {"do": name, **self._ways[name](self.any.randint(0, 3))}

    def setting(self, key: str) -> dict[str, Any]:
        return {"key": key, "value": self.choice((*SETTINGS[key], None))}

    def profile(self, kind: str) -> dict[str, Any]:
        return {"kind": kind, "name": self.choice(NAMES[kind])}

    def point(self, reach_mm: float) -> list[float]:
        return [self.any.uniform(-reach_mm, reach_mm) for _ in range(3)]

    def plane(self) -> dict[str, Any]:
        return {"normal": self.point(1.0), "offset_mm": self.any.uniform(-9.0, 40.0)}

    def rotation(self) -> list[list[float]]:
        rows: list[list[float]] = about(unit(self.point(1.0)), self.choice((0.5, 3.0))).tolist()
        return rows

    def zone(self) -> dict[str, Any]:
        if self.choice((True, False)):
            return {"point_mm": [*self.point(5.0)[:2], 0.0], "angle_deg": self.any.uniform(0.0, 190.0)}
        low, size_mm = self.point(self.choice((30.0, 9.9e4))), self.choice((1e-10, 1.0, 400.0))
        axes = self.choice(({}, {"axes": self.rotation()}))
        return {"min_mm": low, "max_mm": [x + size_mm * self.any.random() for x in low], **axes}


class Tried:
    """A session whose processes answer at once, with its saved plan."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.asked, self.folder, self.plan = Anything(seed), folder, folder / "plan.toml"
        self.session = Session(load(), Given(), WorkerPools())
        for tasks in (self.session.quick, self.session.long, self.session.hand):
            tasks.run = self._run  # type: ignore[method-assign]
        self.session.refuse = self._refuse  # type: ignore[method-assign]

    async def _run(self, task: Any, *given: Any, **more: Any) -> Any:
        match task.__name__:
            case "try_cuts":
                return Trial(())
            case "read_model":
                return read_model(lambda report: None, *given)
            case "mark":
                return task(lambda report: None, *given)
            case "stand":
                return Standing((40.0, 8.0, 40.0), 0.0, "")
            case "price_row":
                return given[0].rows[given[1]]
            case _:
                return given[0].rows if task.__name__ == "measure_plan" else ()

    def _refuse(self, error: Exception) -> str:
        if not isinstance(error, UserError):
            raise error
        return str(error)

    async def take(self, asked: dict[str, Any]) -> None:
        session = self.session
        try:
            match asked["do"]:
                case "found":
                    session.do("find parts", with_front(session.bench, [*FRONT[:2], replace(FRONT[2], chosen=True)]))
                case "save":
                    self.plan.write_text(said(session.bench))
                case "open":
                    await session.open_plan(self.plan)
                case "profile file":
                    path = str(self.folder / "mine.toml")
                    session.start(session.take_given("take it", lambda given: with_value(given, "machine", path)))
                case _:
                    obey(session, asked)
        except UserError:
            pass
        while self.session._tasks:
            await asyncio.gather(*self.session._tasks)


def said(bench: Bench) -> str:
    return plan_text(plan_of_bench(bench, "plan.toml"))


@pytest.mark.parametrize("seed", range(4))
def test_after_any_commands_the_plan_is_read_again_as_it_is_and_undo_and_redo_lead_back(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("machine.workbench.session.planes.CHANGING_S", 0.0)
    monkeypatch.setattr("machine.workbench.session.long_work.REST_S", 0.0)
    (tmp_path / "tee.stl").write_bytes(stl(tee()))
    (tmp_path / "mine.toml").write_text('inherits = "open5x_jubilee"\n[machine]\nname = "mine"\n')

    async def run() -> None:
        tried = Tried(seed, tmp_path)
        session = tried.session
        await session.open_model(tmp_path / "tee.stl", "tee.stl")
        for _ in range(COMMANDS):
            await tried.take(tried.asked.command())
            if session.bench.model is None:  # everything is undone
                await tried.take({"do": "redo"})
        bench, given = session.bench, session.bench.given
        await tried.take({"do": "save"})
        plan = read_plan(tried.plan)
        own = with_part_settings(bench.profile.of_all_parts, plan.settings)
        again = with_plan(bench, plan, bench.rows, own)
        assert (said(again), again.profile) == (said(bench), bench.profile)
        assert load(given.machine, given.material, given.process, given.settings) == bench.profile.of_all_parts
        assert export_command(bench).startswith("tiltprint export tee.stl")
        before = [step.bench for step in session.history.before]
        assert len(before) > 20
        for step in reversed(before):
            await tried.take({"do": "undo"})
            assert session.bench.printed == step.printed
        for _ in before:
            await tried.take({"do": "redo"})
        assert said(session.bench) == tried.plan.read_text()

    asyncio.run(run())
