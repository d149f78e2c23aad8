"""The print campaign: its runs, their outcomes, its table; and a sample of it, which prints without a finding or a suspicion."""

import json
from pathlib import Path

import numpy as np
import pytest

from machine.cli.cli import main as tiltprint
from mdp.read import read_mesh
from profiles.profile import load
from tests.machine.dryrun.planted import FAULTS
from tools.campaign_planted import FOUND, MISSED, NOWHERE, plant_all, planted_table
from tools.campaign_prints import append, main, read
from tools.campaign_run import BUG, FINDINGS, KILLED, PRINTED, REFUSED, Ended, Limits, run_print
from tools.campaign_runs import Run, all_runs, longest_side_mm, model_file, options_of
from tools.campaign_table import table
from tools.print_forms import FAMILIES, form, form_names, write_stl
from tools.print_look import look_at

SMALL = Run("forms", "stairs-001", "stairs-001")
SAMPLE_MM = 15.0


@pytest.mark.parametrize("name", form_names(2 * len(FAMILIES)))
def test_a_form_is_a_closed_solid_on_the_plate_and_the_same_at_every_call(name: str, tmp_path: Path) -> None:
    vertices, faces = form(name)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
    assert 15.0 - 1e-9 <= np.ptp(vertices, axis=0).max() <= 70.0 + 1e-9
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert (form(name)[0] == vertices).all()
    write_stl(tmp_path / "form.stl", vertices, faces)
    corners = vertices[faces]
    volume_mm3 = np.linalg.det(corners).sum() / 6.0
    assert read_mesh(tmp_path / "form.stl")[0].volume_mm3 == pytest.approx(volume_mm3, rel=1e-3)


def test_runs_have_one_order_whatever_else_there_is_and_a_share_of_them_varies() -> None:
    runs, more = all_runs({}, 120, 0.1), all_runs({}, 400, 0.1)
    names = [run.name for run in runs]
    assert [run.name for run in more if run in runs] == names
    assert len(set(names)) == len(names)
    assert 0.05 < sum(run.varies for run in more) / 400 < 0.15


def test_settings_that_vary_are_decided_by_the_name_and_make_a_profile(tmp_path: Path) -> None:
    file = model_file(SMALL, tmp_path)
    for run in [Run("forms", name, name, True) for name in form_names(25)]:
        options = options_of(run, file)
        assert options == options_of(run, file)
        words = dict(zip(options[0:4:2], options[1:4:2], strict=True))
        settings = [options[k + 1] for k, word in enumerate(options) if word == "--set"]
        profile = load(machine=words["--machine"], material=words["--material"], settings=settings)
        assert 0.2 <= profile.process.scale <= 4.0
    assert options_of(SMALL, file) == []


def test_a_mesh_of_arrays_is_60_mm_long_and_a_file_stays_what_it_is(tmp_path: Path) -> None:
    vertices, faces = form("stairs-001")
    np.savez(tmp_path / "stairs.npz", vertices=vertices.astype(np.float32), faces=faces.astype(np.int32))
    write_stl(tmp_path / "steps.stl", vertices, faces)
    file = model_file(Run("meshes", "stairs", str(tmp_path / "stairs.npz")), tmp_path)
    assert longest_side_mm(file) == pytest.approx(60.0, rel=1e-5)
    assert model_file(Run("models", "steps", str(tmp_path / "steps.stl")), tmp_path) == tmp_path / "steps.stl"


@pytest.mark.parametrize(("code", "said", "outcome"), [
    (0, "", PRINTED), (1, "tiltprint: model.stl: is empty", REFUSED), (-9, "", KILLED), (-11, "", BUG),
    (1, "dry run\ntiltprint: the dry run found 2 errors, the first: x", FINDINGS), (3, "tiltprint: a bug in tiltprint", BUG),
    (3, "tiltprint: a bug in tiltprint: MemoryError: ; the details", KILLED)])  # fmt: skip
def test_how_a_run_ended_is_told_by_its_code_and_its_sentence(code: int, said: str, outcome: str) -> None:
    assert Ended(code, said, 1.0, 1.0, 1.0).outcome == outcome


def test_runs_of_the_real_program_end_as_they_should_and_stand_in_the_table(tmp_path: Path) -> None:
    vertices, faces = form(SMALL.source)
    write_stl(tmp_path / "large.stl", 20.0 * vertices, faces)
    write_stl(tmp_path / "slow.stl", 5.0 * vertices, faces)
    large, slow = (Run("models", name, str(tmp_path / f"{name}.stl")) for name in ("large", "slow"))
    records = [
        run_print(SMALL, tmp_path, Limits(), keep=True),
        run_print(slow, tmp_path, Limits(core_s=1), keep=False),
        run_print(large, tmp_path, Limits(), keep=False),
    ]
    assert [record and record["outcome"] for record in records] == [PRINTED, KILLED, REFUSED]
    assert run_print(SMALL, tmp_path, Limits(begin_before=0.0), keep=False) is None
    assert records[0] is not None
    assert records[0]["core_s"] > 0.5
    assert records[0]["memory_mb"] > 50
    assert (records[0]["parts"], records[0]["suspect"]) == (1, [])
    assert (tmp_path / "kept" / "forms_stairs-001.gcode").exists()
    rows = table([record for record in records if record]).splitlines()
    assert rows[2].startswith("| forms | 1 | 1 (100.0%) | 0 | 0 | 0 | 0 | 0 |")
    assert rows[3].startswith("| models | 2 | 0 (0.0%) | 1 | 0 | 0 | 1 | 0 |")
    assert "plate" in rows[-1] or "axis" in rows[-1] or "reach" in rows[-1]


def test_records_survive_a_line_that_was_cut_off(tmp_path: Path) -> None:
    file = tmp_path / "runs.jsonl"
    append(file, {"name": "a"})
    file.write_text(file.read_text() + json.dumps({"name": "b"})[:5])
    append(file, {"name": "c"})
    assert [record["name"] for record in read(file)] == ["a", "c"]


def test_a_model_that_cannot_be_read_is_refused_with_its_sentence(tmp_path: Path) -> None:
    (tmp_path / "broken.stl").write_text("no mesh")
    record = run_print(Run("hard", "broken", str(tmp_path / "broken.stl"), varies=True), tmp_path, Limits(), keep=False)
    assert record is not None
    assert (record["outcome"], "is not an STL file" in record["sentence"]) == (REFUSED, True)


def print_at_once(run: Run, *_: object) -> dict[str, object]:
    """The record of a print that takes no time."""
    figures = {"core_s": 1.0, "memory_mb": 99, "parts": 1, "lines": 9}
    return {"name": run.name, "group": run.group, "outcome": PRINTED, "sentence": "", **figures}


def test_a_campaign_that_is_started_again_runs_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr("tools.campaign_prints.warm_up", lambda limits: None)
    monkeypatch.setattr("tools.campaign_prints.run_print", print_at_once)
    for count in ("1", "2", "2"):
        arguments = ["--forms", "24", "--varied-share", "0", "--only", "stairs", "--sample", count]
        monkeypatch.setattr("sys.argv", ["campaign", str(out), *arguments])
        main()
    names = [record["name"] for record in read(out / "runs.jsonl")]
    assert names == [run.name for run in all_runs({}, 24, 0.0) if "stairs" in run.name][:2]
    assert "| forms | 2 | 2 (100.0%) |" in (out / "table.md").read_text()


@pytest.mark.slow
def test_faults_planted_into_a_print_of_one_part_are_found_where_they_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    named = ("a layer missing", "no fans", "a speed of 0", "a part shifted by 0.5 mm")
    monkeypatch.setattr("tools.campaign_planted.FAULTS", [*(f for f in FAULTS if f.name in named), *FAULTS[::6]])
    record = plant_all(Run("forms", "voids-006", "voids-006"), Limits())
    assert record is not None
    results = record["results"]
    assert (results["a layer missing"], results["no fans"], results["a speed of 0"]) == (FOUND, FOUND, FOUND)
    assert results["a part shifted by 0.5 mm"] == NOWHERE
    assert [name for name, end in results.items() if end == MISSED] == []
    row = next(line for line in planted_table([record]).splitlines() if line.startswith("| no fans |"))
    assert row == "| no fans | 1 | 0 | 0 | 0 | - |"


@pytest.mark.slow
@pytest.mark.parametrize("name", form_names(len(FAMILIES)))
def test_a_form_of_each_family_prints_without_a_suspicion(name: str, tmp_path: Path) -> None:
    file = model_file(Run("forms", name, name), tmp_path)
    scale = min(1.0, SAMPLE_MM / longest_side_mm(file))
    gcode = tmp_path / "print.gcode"
    assert tiltprint(["export", str(file), "-o", str(gcode), "--set", f"process.scale={scale:.3f}"]) == 0
    assert look_at(gcode.read_text().split("\n")).suspect == []
