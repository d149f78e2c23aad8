from pathlib import Path

import numpy as np
import pytest

from tests import shapes
from tools.compare_widths import Row, interval, main, rankers_table, ratios, read, record, summary, table


def _row(mesh: str, method: str, width: int, share: float, error: str = "") -> Row:
    return Row(mesh, "", method, width, 100, 50.0, 50.0 * share, share, 3, 2.0, 1.0, 1000, error)


def _cells(text: str, method: str, width: int) -> list[str]:
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {method} | {width} |")]
    return [cell.strip() for cell in line.strip("|").split("|")]


FOUND = [
    *(_row("a", "best", 1, 0.8), _row("b", "best", 1, 0.4), _row("c", "best", 1, 0.0)),
    *(_row("a", "best", 2, 0.4), _row("b", "best", 2, 0.4), _row("c", "best", 2, 0.2)),
    *(_row("a", "published", 2, 0.5), _row("b", "published", 2, 0.4), _row("c", "published", 2, 0.5)),
]


def test_shares_are_averaged_over_the_models() -> None:
    assert [_cells(table(FOUND, ""), "best", width)[3] for width in (1, 2)] == ["0.4000", "0.3333"]
    assert _cells(table(FOUND, ""), "best", 2)[4] == "16.7"


def test_wins_ties_and_losses_are_counted_against_the_next_narrower_and_against_the_published_search() -> None:
    cells = _cells(table(FOUND, ""), "best", 2)
    assert cells[8:10] == ["1, 1, 1", "33.3%"]
    assert cells[10:12] == ["0.7143", "2, 1, 0"]


def test_a_model_that_failed_at_one_width_counts_at_none() -> None:
    text = table([*FOUND[:-1], _row("c", "published", 2, 1.0, "RuntimeError: no")], "")
    assert [_cells(text, "best", width)[2:4] for width in (1, 2)] == [["2", "0.6000"], ["2", "0.4000"]]
    assert "1 of 2 searches failed\n- c, published, width 2: no" in list(
        summary([FOUND[0], _row("c", "published", 2, 1.0, "no")])
    )


def test_a_learned_ranker_is_held_against_plain_beams_without_what_no_cut_can_save() -> None:
    def row(mesh: str, width: int, share: float, core_s: float, ranker: str = "classic") -> Row:
        return Row(mesh, "", "best", width, 9, 50.0, 50.0 * share, share, 3, core_s, 1.0, 9, "", ranker, floor=0.1)

    plain = [row(mesh, *figures) for mesh in "ab" for figures in ((1, 0.6, 1.0), (2, 0.5, 2.0), (10, 0.3, 8.0))]
    learned = [row("a", 2, 0.5, 2.0, "learned"), row("b", 2, 0.46, 2.0, "learned")]
    lines = rankers_table([*plain, *learned], "").splitlines()
    (cells,) = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| learned | 2 |")]
    assert cells[2:4] == ["0.3800", "0.7600"]  # of 0.5 without the floor
    assert cells[4:6] == ["120%", "10%"]
    assert cells[6:] == ["2.00", "0.25", "0.0%", "50.0%"]


def test_a_learned_ranker_without_a_plain_search_beside_it_is_compared_with_nothing() -> None:
    alone = Row("a", "", "best", 2, 9, 50.0, 25.0, 0.5, 3, 2.0, 1.0, 9, "", "learned")
    (line,) = [line for line in rankers_table([alone], "").splitlines() if line.startswith("| learned")]
    assert [cell.strip() for cell in line.strip("|").split("|")] == ["learned", "2", "0.5000", *"-------"]


def test_equal_values_have_the_ratio_one_even_when_both_are_nothing() -> None:
    assert ratios(np.array([0.0, 0.3, 0.2]), np.array([0.0, 0.3, 0.4])) == pytest.approx([1.0, 1.0, 0.5])


def test_differences_below_a_millionth_are_ties() -> None:
    assert record(np.array([0.3, 0.3, 0.3]), np.array([0.3 + 5e-7, 0.2, 0.4])) == (1, 1, 1)


def test_the_interval_of_equal_values_is_that_value_and_of_others_agrees_with_the_normal_law() -> None:
    values = np.random.default_rng(1).normal(1.0, 0.1, 400)
    assert interval(np.full(5, 0.7)) == pytest.approx((0.7, 0.7))
    assert interval(values) == pytest.approx((values.mean() - 0.0098, values.mean() + 0.0098), abs=0.001)


def test_a_run_writes_one_line_a_search_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    mesh, out = shapes.branch(), tmp_path / "out.csv"
    np.savez(tmp_path / "branch.npz", vertices=mesh.vertices.astype(np.float32), faces=mesh.faces)
    np.savez(tmp_path / "open.npz", vertices=mesh.vertices.astype(np.float32), faces=mesh.faces[20:])
    words = [str(tmp_path), "--out", str(out), "--set", "search.directions=100", "--widths"]
    main([*words, "1"])
    once = out.read_text()
    main([*words, "1,2"])
    assert out.read_text().startswith(once)
    assert [(row.mesh, row.width, row.error[:9]) for row in read(out)] == [
        *(("branch", 1, ""), ("open", 1, "MeshError"), ("branch", 2, ""), ("open", 2, "MeshError")),
    ]
