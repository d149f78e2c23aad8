from pathlib import Path

import numpy as np
import pytest

from mdp.batch.rows import read_rows
from tests import shapes
from tools.campaigns.widths import Row, main


def test_a_run_writes_one_line_per_search_and_continues_where_it_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh, out = shapes.tee(), tmp_path / "out.csv"
    np.savez(tmp_path / "tee.npz", vertices=mesh.vertices.astype(np.float32), faces=mesh.faces)
    np.savez(tmp_path / "open.npz", vertices=mesh.vertices.astype(np.float32), faces=mesh.faces[5:])
    words = [str(tmp_path), "--out", str(out), "--set", "search.directions=40", "--widths"]
    main([*words, "1"])
    once = out.read_text()
    capsys.readouterr()
    main([*words, "1,2,2"])
    assert "2 of 4 searches failed\n- open, best, width 1: MeshError" in capsys.readouterr().out
    assert out.read_text().startswith(once)
    assert [(row.mesh, row.width, row.error[:9]) for row in read_rows(out, Row)] == [
        *(("open", 1, "MeshError"), ("tee", 1, ""), ("open", 2, "MeshError"), ("tee", 2, "")),
    ]


def test_a_summary_of_no_table_of_searches_ends_with_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.csv"
    for text, sentence in (
        (None, "cannot be read ([Errno 2] No such file"),
        ("", "has no column mesh, settings"),
        ("mesh,width\na,wide\n", "has no column settings, method"),
        ("mesh,settings,method,width,share,core_s\na,s\n", "the line of a has not as many values as there are columns"),
        ("mesh,settings,method,width,share,core_s\na,s,best,1,0.5,2\n", "its columns are not mesh, settings"),
    ):
        if text is not None:
            out.write_text(text)
        assert main(["--out", str(out), "--summary"]) == 1
        assert sentence in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--widths", "a"), "'a': whole numbers between commas are allowed"),
        (("--every", "0"), "--every is 0: 1 or more is allowed"),
        (("--faces", "0"), "--faces is 0: 4 or more is allowed"),
        (("--methods", "clever"), "search.method is"),
        (("--rankers", "mine"), "--ranker mine: classic, learned or the name of an .onnx file is allowed"),
        (("--widths", "0"), "search.beam_width is 0"),
        (("--only", "zzz"), "holds no model with 'zzz' in its name"),
        (("--out", "nowhere/out.csv"), "nowhere"),
    ],
)
def test_a_run_that_cannot_be_made_ends_with_a_sentence(
    words: tuple[str, str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savez(tmp_path / "tee.npz", vertices=shapes.tee().vertices, faces=shapes.tee().faces)
    assert main([str(tmp_path), "--out", str(tmp_path / "out.csv"), *words]) == 1
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "out.csv").exists()


def test_a_setting_with_a_blank_stays_one_setting(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savez(tmp_path / "tee.npz", vertices=shapes.tee().vertices, faces=shapes.tee().faces)
    words = ["--set", "process.name=my own", "--set", "search.directions=40", "--widths", "1"]
    assert main([str(tmp_path), "--out", str(tmp_path / "out.csv"), *words]) == 0
    assert [row.settings for row in read_rows(tmp_path / "out.csv", Row)] == ["'process.name=my own' search.directions=40"]
