"""Slices on the workbench: the drawing of a part, whether it can be printed, and G-code with errors."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from starlette.requests import Request
from starlette.responses import FileResponse

from machine.dryrun.findings import Finding, known_findings
from machine.pipeline.requests import ModelRequest
from machine.program import Alternative
from machine.workbench.web.server import gcode
from machine.workbench.web.snapshot import SLICE_AGAIN, SUPPORT_ON, verdict_of
from machine.workbench.work.slices import Sliced, open_gcode, walls
from profiles.errors import PlanError
from profiles.profile import load
from slicer.slice import slice_parts
from tests.machine.pages import opened
from tests.shapes import box
from tests.slicer.hand import cut, profile

SIDE = (1.0, 0.0, 0.0)


@pytest.mark.parametrize("most", [60_000, 100])
def test_the_walls_of_a_part_are_on_its_surface_in_every_printing_direction(most: int) -> None:
    parts = cut(box(30, 10, 10), (SIDE, 5.0))
    values = np.frombuffer(walls(parts[1], slice_parts(parts, profile())[1], most), "<f4")
    pieces = values[3:].reshape(-1, 7)
    begins, ends, heights = pieces[:, :3], pieces[:, 3:6], pieces[:, 6]
    assert values[:3].tolist() == list(SIDE)
    assert np.allclose(begins[:, 0], ends[:, 0], atol=1e-4)  # level, seen along the direction of printing
    half_mm = float(heights.max()) / 2.0  # the first layer and the last one are lower
    assert float(begins[:, 0].min()) == pytest.approx(5.0 + half_mm, abs=2.0 * half_mm)
    assert float(begins[:, 0].max()) == pytest.approx(15.0 - half_mm, abs=2.0 * half_mm)
    assert float(np.abs(begins[:, 1]).max()) == pytest.approx(5.0, abs=0.5)
    layers = len(np.unique(begins[:, 0].round(3)))
    assert layers * 2.0 * half_mm == pytest.approx(10.0, abs=3.0 * half_mm)
    assert (layers < 30) == (most == 100)
    from_middle_mm = np.abs(begins - (0.0, 0.0, 5.0))[begins[:, 0] < 13.0, 1:].max(axis=1)  # below the top
    assert (np.median(from_middle_mm) < 4.6) == (most != 100)  # inner walls where there is room for them


def test_g_code_with_errors_is_saved_only_after_confirmation(tmp_path: Path) -> None:
    error = Finding("error", "contact", 12, 1, 3, "the nozzle touches the part")
    cost = Alternative("in 1 part", "", 1, 60.0, 1.0, 1.0, 0.0, 0.0)
    known = known_findings(["G28"], profile(), [error])
    sliced = Sliced(tmp_path / "page", tmp_path / "gcode", "key", 60.0, 1.0, known, cost)
    session: Any = SimpleNamespace(slicing=SimpleNamespace(needed=lambda: SimpleNamespace(sliced=sliced)))
    session.bench = SimpleNamespace(plate=[SimpleNamespace(model=SimpleNamespace(name="demo:tree"))])
    refused, forced = (Request({"type": "http", "query_string": query}) for query in (b"", b"force=yes"))
    with pytest.raises(PlanError, match="found 1 error, the first: the nozzle touches the part: no G-code is saved unless"):
        asyncio.run(gcode(session, refused))
    answer = asyncio.run(gcode(session, forced))
    assert isinstance(answer, FileResponse)
    assert (answer.path, answer.headers["content-disposition"]) == (
        sliced.gcode,
        "attachment; filename=\"tree.gcode\"; filename*=UTF-8''tree.gcode",
    )


def finding(severity: str, code: str, message: str) -> Finding:
    return Finding("error" if severity == "error" else "warning", code, 1, 1, 1, message)


CRASH = finding("error", "collision", "the nozzle touches the part")
UNCALIBRATED = finding("warning", "uncalibrated", "measure it")


def test_slices_without_findings_are_ready() -> None:
    verdict = verdict_of((), load(), 0.0, out_of_date=False)
    assert (verdict["kind"], verdict["text"], verdict["remedy"]) == ("ready", "Ready to print", None)


def test_warnings_do_not_keep_it_from_being_printed() -> None:
    assert verdict_of((UNCALIBRATED,), load(), 0.0, out_of_date=False)["text"] == "Ready to print; 1 warning below"


def test_the_first_error_is_the_problem_and_says_which_finding_it_is() -> None:
    verdict = verdict_of((UNCALIBRATED, CRASH, CRASH), load(), 0.0, out_of_date=False)
    assert (verdict["kind"], verdict["finding"]) == ("problem", 1)
    assert verdict["text"] == "2 problems, the first: the nozzle touches the part"
    assert verdict_of((CRASH,), load(), 0.0, out_of_date=False)["text"] == "1 problem: the nozzle touches the part"


def test_overhangs_without_support_get_a_button_that_switches_support_on() -> None:
    off = load(settings=["process.support=none"])
    verdict = verdict_of((UNCALIBRATED,), off, 812.4, out_of_date=False)
    assert (verdict["text"], verdict["remedy"]) == ("Ready to print, but 812 mm² would need support", SUPPORT_ON)
    assert verdict_of((), load(), 812.4, out_of_date=False)["remedy"] is None
    assert verdict_of((), off, 0.5, out_of_date=False)["remedy"] is None


def test_slices_of_another_bench_are_to_be_made_again() -> None:
    verdict = verdict_of((CRASH,), load(), 0.0, out_of_date=True)
    assert (verdict["kind"], verdict["remedy"]) == ("stale", SLICE_AGAIN)


def test_the_page_of_a_gcode_file_without_a_machine_lists_every_error_of_the_machine_it_is_tried_for(tmp_path: Path) -> None:
    file = tmp_path / "far.gcode"
    file.write_text("G21\nG90\nM83\nG28\nM104 S210\nM109 S210\nG1 Z0.3 F600\nG1 X9999 E1 F600\nM104 S0\n")
    tried = open_gcode(print, ModelRequest(str(file), load()), tmp_path / "page", tmp_path / "copy")
    listed = {finding["message"] for finding in opened(tried.page.read_bytes())[0]["findings"] if finding["severity"] == "error"}
    assert len(listed) == len(tried.errors) > 0
    assert any("9999" in message for message in listed)


def test_a_gcode_file_that_is_tried_for_another_machine_has_another_page(tmp_path: Path) -> None:
    file = tmp_path / "box.gcode"
    file.write_text("G21\nG90\nM83\nG28\nM104 S210\nM109 S210\nG1 Z0.3 F600\nG1 X10 E1 F600\nM104 S0\n")
    requests = [ModelRequest(str(file), load(machine=machine)) for machine in ("generic_ac", "gen5x")]
    first, second = (open_gcode(print, request, tmp_path / "page", tmp_path / "copy") for request in requests)
    assert first.known.profile.machine != second.known.profile.machine
    assert first.key != second.key
