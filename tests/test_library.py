"""The example of docs/library.md runs unchanged."""

import re
from pathlib import Path

import pytest

from mdp.save import stl
from tests.shapes import tee

PAGE = Path(__file__).resolve().parents[1] / "docs" / "library.md"


def test_the_example_leads_from_a_mesh_to_a_simulated_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.stl").write_bytes(stl(tee()))
    exec(compile(example, str(PAGE), "exec"), {})
    first, last = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"\d+ parts, \d+ min, \d+ findings", first)
    text = (tmp_path / "part.gcode").read_text()
    commands = [line for line in text.splitlines() if line.partition(";")[0].strip()]
    assert last.startswith(f"{len(commands)} lines printed by Marlin")
