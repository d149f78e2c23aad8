"""What the workbench makes of slices: what is seen of a part, and G-code with errors."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from starlette.requests import Request
from starlette.responses import FileResponse

from machine.dryrun.findings import Finding, known_findings
from machine.program import Alternative
from machine.workbench.web.downloads import gcode
from machine.workbench.work.slices import Sliced, walls
from profiles.errors import PlanError
from slicer.slice import slice_parts
from tests.shapes import box
from tests.slicer.hand import cut, profile

SIDE = (1.0, 0.0, 0.0)


@pytest.mark.parametrize("most", [60_000, 100])
def test_the_walls_of_a_part_lie_on_its_surface_wherever_it_is_printed_to(most: int) -> None:
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


def test_g_code_with_errors_is_saved_only_for_who_wants_it_all_the_same(tmp_path: Path) -> None:
    error = Finding("error", "contact", 12, 1, 3, "the nozzle touches the part")
    cost = Alternative("in 1 part", "", 1, 60.0, 1.0, 1.0, 0.0, 0.0)
    known = known_findings(["G28"], profile(), [error])
    sliced = Sliced(tmp_path / "page", tmp_path / "gcode", "key", 60.0, 1.0, known, cost)
    session: Any = SimpleNamespace(slicing=SimpleNamespace(needed=lambda: SimpleNamespace(sliced=sliced)))
    session.bench = SimpleNamespace(model=SimpleNamespace(name="demo:tree"))
    refused, forced = (Request({"type": "http", "query_string": query}) for query in (b"", b"force=yes"))
    with pytest.raises(PlanError, match="found 1 error, the first: the nozzle touches the part: no G-code is saved unless"):
        asyncio.run(gcode(session, refused))
    answer = asyncio.run(gcode(session, forced))
    assert isinstance(answer, FileResponse)
    assert (answer.path, answer.headers["content-disposition"]) == (
        sliced.gcode,
        "attachment; filename=\"tree.gcode\"; filename*=UTF-8''tree.gcode",
    )
