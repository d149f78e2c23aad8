"""One search of a collection: reading the model, its orientations, the record, the index line, the tables."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mdp.batch.rows import append_row
from mdp.learning.collection import INDEX, Row, Settings, read_index, run, summary, unfinished, write_index
from mdp.learning.models import coarser, model_files, oriented, read_model
from mdp.mesh import Mesh
from profiles.errors import MeshError, UserError
from profiles.profile import load
from tests import shapes


def _npz(path: Path, mesh: Mesh) -> Path:
    np.savez(path, vertices=mesh.vertices, faces=mesh.faces)
    return path


def test_a_search_gives_its_record_and_its_line(tmp_path: Path) -> None:
    path = _npz(tmp_path / "ball.npz", shapes.ball())
    row, record = run(Row("ball", 0, "paper", Settings(beam_width=3).in_words), path, Settings(beam_width=3))
    with np.load(io.BytesIO(record)) as arrays:
        least, lists, rows = arrays["node_cost"].min(), len(np.unique(arrays["stage"])), len(arrays["stage"])
    assert row.outcome == pytest.approx(least, abs=1e-6)
    assert (row.lists, row.mean_list_length) == (lists, round(rows / lists, 2))
    assert (row.settings, row.late, row.excluded) == ("B=3", 0, "")


@pytest.mark.parametrize(
    ("terms", "reason"), [("ours", "no risky face"), ("paper", "nothing feasible")], ids=lambda value: str(value)
)
def test_a_search_without_a_list_has_no_record(tmp_path: Path, terms: str, reason: str) -> None:
    row, record = run(
        Row("box", 0, terms, Settings(beam_width=1).in_words), _npz(tmp_path / "box.npz", shapes.box()), Settings(beam_width=1)
    )
    assert (row.excluded, record) == (reason, b"")


def test_a_collection_searches_by_the_profiles_and_settings_that_it_is_given() -> None:
    settings = Settings(3, machine="fractal5pro", own=("search.seam_mm=1.5",))
    profile = settings.profile("ours")
    assert (profile.search.seam_mm, profile.search.beam_width, profile.search.polish) == (1.5, 3, False)
    assert profile.machine == load("fractal5pro").machine
    assert settings.in_words == "B=3 machine=fractal5pro search.seam_mm=1.5"


def test_a_search_ended_by_its_time_limit_is_marked(tmp_path: Path) -> None:
    path = _npz(tmp_path / "ball.npz", shapes.ball())
    assert run(Row("ball", 0, "paper", Settings(1, None, 0.0).in_words), path, Settings(1, None, 0.0))[0].late == 1


def test_orientations_are_the_sides_that_a_model_rests_on_and_end_with_them() -> None:
    mesh = shapes.tee()  # on either end of its bar it leans on the foot of its stem; on its back no face is risky
    poses = [oriented(mesh, k, 45.0) for k in range(4)]
    sizes = [pose and np.ptp(pose.vertices, axis=0).round(2).tolist() for pose in poses]
    assert sizes == [[40.0, 10.0, 40.0], [46.96, 10.0, 40.25], [46.96, 10.0, 40.25], None]


def test_a_model_without_a_further_side_is_not_searched_again_in_another_turn(tmp_path: Path) -> None:
    row, record = run(
        Row("tee", 3, "paper", Settings(beam_width=1).in_words), _npz(tmp_path / "tee.npz", shapes.tee()), Settings(beam_width=1)
    )
    assert (row.excluded, record) == ("no further side to rest on", b"")
    assert unfinished(tmp_path, [row], [row.key]) == []


def test_a_fine_model_is_made_coarser_within_two_thousandths_of_its_diagonal() -> None:
    mesh = shapes.ball(10.0, 128)
    simpler = coarser(mesh, 4000)
    assert len(simpler.faces) <= 4000 < len(mesh.faces)
    assert simpler.volume_mm3 == pytest.approx(mesh.volume_mm3, rel=0.01)
    assert np.linalg.norm(simpler.vertices - [0.0, 0.0, 10.0], axis=1) == pytest.approx(10.0, abs=0.002 * 34.7)


def test_an_npz_without_faces_is_refused_by_name(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=np.zeros((3, 3)))
    with pytest.raises(MeshError, match=r"a\.npz holds no vertices and faces"):
        read_model(tmp_path / "a.npz")


def test_models_with_the_same_record_name_are_refused(tmp_path: Path) -> None:
    for name in ("a.b.npz", "a_b.stl"):
        (tmp_path / name).touch()
    with pytest.raises(UserError, match=r"a\.b\.npz and a_b\.stl would have the same records"):
        model_files(tmp_path)


def test_an_index_keeps_the_last_line_of_a_search(tmp_path: Path) -> None:
    row = Row("a", 0, "paper", "B=50", excluded="failed: once")
    write_index(tmp_path, [row])
    append_row(tmp_path / INDEX, replace(row, excluded="", outcome=0.25))
    (read,) = read_index(tmp_path)
    assert (read.excluded, read.outcome) == ("", 0.25)


def test_failed_runs_and_lost_records_are_repeated(tmp_path: Path) -> None:
    reasons = {"a": "", "b": "", "c": "no risky face", "d": "failed: by accident"}
    rows = [Row(name, 0, "paper", "B=50", excluded=reason) for name, reason in reasons.items()]
    (tmp_path / "a.0.paper.npz").touch()
    missing = unfinished(tmp_path, rows, [*(row.key for row in rows), ("e", 0, "paper")])
    assert [name for name, _, _ in missing] == ["b", "d", "e"]


def test_a_collection_is_summarized_in_tables() -> None:
    done = Row("a", 0, "paper", "B=3", lists=3, mean_list_length=3.0, outcome=0.5, seconds=36.0)
    alike = Row("a", 1, "paper", "B=3", lists=1, mean_list_length=5.0, outcome=0.7)
    counts, reasons, failed = summary([done, alike, Row("b", 0, "paper", "B=3", excluded="failed: no mesh")])
    assert counts.splitlines()[-1] == "| paper | B=3 | 3 | 2 | 2 | 4 | 3.5 | 0.6000 | 0.01 | 0 |"
    assert reasons.splitlines()[-1] == "| paper | failed | 1 |"
    assert failed == "- b.0.paper.npz: no mesh"
