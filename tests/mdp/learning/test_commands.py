from pathlib import Path

import numpy as np
import pytest

from mdp.learning import evaluate, train
from mdp.learning.lists import Side, side
from mdp.ranking.features import COLUMNS
from tests.mdp.learning.records import write_record

EXTRA = ("torch", "onnx", "xgboost", "matplotlib")
SLOW = "RankNet,RankNet (tuned),LambdaRank,LambdaRank (tuned)"


@pytest.fixture
def records(tmp_path: Path) -> Path:
    """Twelve records of two lists each."""
    folder = tmp_path / "records"
    folder.mkdir()
    rng = np.random.default_rng(0)
    for number in range(12):
        stage = np.repeat(np.array([1, 2], np.int32), 12)
        features = rng.random((24, len(COLUMNS)))
        write_record(folder / f"m{number}.0.paper.npz", rng.random(24), stage, columns=np.array(COLUMNS), features=features)
    return folder


def _needs(*libraries: str) -> None:
    for library in libraries:
        pytest.importorskip(library, reason="the extra `train` is not installed")


def test_the_records_have_models_on_every_side(records: Path) -> None:
    assert {side(file.name.split(".")[0]) for file in records.iterdir()} == set(Side)


@pytest.mark.train
def test_a_ranker_is_trained_and_judged_by_two_commands(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _needs(*EXTRA)
    ranker = tmp_path / "ranker.onnx"
    assert train.main([str(records), "-o", str(ranker), "--epochs", "3"]) == 0
    assert '"NDCG@5": 0.' in capsys.readouterr().out
    assert sorted(file.name for file in tmp_path.iterdir()) == ["ranker.onnx", "records"]
    asked = [str(records), "--ranker", str(ranker), "--without", SLOW, "--pictures", str(tmp_path)]
    assert evaluate.main(asked) == 0
    printed = capsys.readouterr().out
    rows = (str(ranker), "random", "M2", "M2 - lambda M6")
    assert all(f"| {name} |" in printed for name in rows)
    assert "| M6 |" in printed
    assert "Regret over the candidates that were followed: " in printed
    assert (tmp_path / "figure8-ranker.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.train
def test_an_ensemble_with_little_regret_is_trained_on_some_terms(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _needs("torch", "onnx")
    asked = [str(records), "-o", str(tmp_path / "a.onnx"), "--loss", "regret", "--columns", "paper", "--epochs", "2"]
    assert train.main([*asked, "--ensemble", "2", "--terms", "paper"]) == 0
    printed = capsys.readouterr()
    assert '"NDCG@5": 0.' in printed.out
    assert " records, " in printed.out
    assert printed.err.count("epoch 2: loss") == 2
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.onnx", "records"]
    assert train.main([*asked, "--terms", "paper,ours"]) == 1
    assert "holds no record (*.ours.npz)" in capsys.readouterr().err


@pytest.mark.train
def test_figure_7_is_drawn_from_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib", reason="the extra `train` is not installed")
    table = tmp_path / "widths.csv"
    rows = [
        f"a,s,best,{width},{share},1,{name}"
        for name, width, share in (("classic", 1, 0.5), ("classic", 2, 0.4), ("learned", 1, 0))
    ]
    table.write_text("\n".join(["mesh,settings,method,width,share,core_s,ranker", *rows]))
    assert evaluate.main(["--figure7", str(table), "--pictures", str(tmp_path / "pictures")]) == 0
    assert "figure7.png" in capsys.readouterr().out
    assert (tmp_path / "pictures" / "figure7.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "a folder of records or --figure7 is needed"),
        (["--least-removed", "2", "nowhere"], "--least-removed is 2: 0 to 1 is allowed"),
        (["--fold", "few", "nowhere"], "argument --fold: invalid int value: 'few'; --help shows what is allowed"),
    ],
)
def test_an_impossible_command_is_refused_in_one_sentence(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate.main(arguments) == 1
    assert sentence in capsys.readouterr().err


@pytest.mark.train
def test_a_folder_without_records_and_an_unknown_baseline_are_refused(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _needs(*EXTRA)
    assert train.main([str(tmp_path), "-o", str(tmp_path / "a.onnx")]) == 1
    assert "holds no record" in capsys.readouterr().err
    assert train.main([str(records), "-o", str(tmp_path / "nowhere" / "a.onnx")]) == 1
    assert "cannot be written; a file in a folder that exists is needed" in capsys.readouterr().err
    assert evaluate.main([str(records), "--without", "luck"]) == 1
    assert "--without luck is not a baseline" in capsys.readouterr().err
