from pathlib import Path

import numpy as np
import pytest

from mdp.learning.widths import TimedSearch, compare, read_searches, table
from profiles.errors import UserError

HEAD = "mesh,settings,method,width,risky_mm2,share,core_s,error"


def search(mesh: str, ranker: str, width: int, share: float) -> TimedSearch:
    return TimedSearch(mesh, "", "best", ranker, width, share, 2.0 * width)


def cells(text: str, ranker: str, width: int) -> list[str]:
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {ranker} | {width} |")]
    return [cell.strip() for cell in line.strip("|").split("|")][2:]


def test_a_comparison_counts_only_models_for_which_every_search_was_made() -> None:
    learned = [search(mesh, "learned", 1, share) for mesh, share in (("a", 0.2), ("b", 0.4), ("c", 0.9))]
    plain = [search(mesh, "classic", width, 0.5 / width) for mesh in ("a", "b") for width in (2, 1)]
    (comparison,) = compare([*learned, *plain])
    assert comparison.models == ("a", "b")
    assert comparison.plain_widths == [1, 2]
    assert comparison.shares["learned", 1].tolist() == [0.2, 0.4]
    assert comparison.core_s["classic", 2].tolist() == [4.0, 4.0]


def test_models_from_which_the_widest_plain_beam_removes_little_are_left_out() -> None:
    plain = [search(mesh, "classic", 50, share) for mesh, share in (("a", 0.94), ("b", 0.96))]
    learned = [search(mesh, "learned", 2, 0.5) for mesh in "ab"]
    (comparison,) = compare([*plain, *learned], least_removed=0.05)
    assert comparison.models == ("a",)
    assert not compare([*plain, *learned], least_removed=0.5)


def test_a_row_holds_the_mean_the_ratio_to_plain_the_closed_gap_and_the_core_time() -> None:
    plain = [search(mesh, "classic", *figures) for mesh in "ab" for figures in ((1, 0.8), (2, 0.6), (10, 0.4), (50, 0.5))]
    learned = [search("a", "learned", 2, 0.6), search("b", "learned", 2, 0.4)]
    (comparison,) = compare([*plain, *learned])
    own = cells(table(comparison), "learned", 2)
    assert own == ["0.5000", "0.6250", "0.5000 to 0.7500", "50%", "0% to 100%", "0.04", "0.0%", "50.0%"]
    assert cells(table(comparison), "classic", 10)[3:5] == ["100%", "100% to 100%"]


def test_a_learned_ranker_without_a_plain_search_has_no_comparison() -> None:
    (comparison,) = compare([search("a", "learned", 2, 0.5)])
    assert cells(table(comparison), "learned", 2) == ["0.5000", *"-------"]


def test_core_times_of_nothing_are_compared_with_nothing() -> None:
    (comparison,) = compare([TimedSearch("a", "", "best", "classic", 1, 0.5, 0.0)])
    assert cells(table(comparison), "classic", 1)[5] == "-"


def test_the_interval_agrees_with_the_normal_law() -> None:
    shares = np.random.default_rng(1).normal(0.5, 0.05, 400)
    searches = [
        search(str(n), name, 1, share) for n, own in enumerate(shares) for name, share in (("classic", 0.5), ("own", own))
    ]
    (comparison,) = compare(searches)
    low, high = (float(end) for end in cells(table(comparison), "own", 1)[2].split(" to "))
    assert (low, high) == pytest.approx((2 * shares.mean() - 0.0098, 2 * shares.mean() + 0.0098), abs=0.002)


def test_models_without_a_risky_face_and_failed_searches_do_not_count(tmp_path: Path) -> None:
    file = tmp_path / "widths.csv"
    file.write_text(f"{HEAD}\na,s,best,1,9,0.5,2,\nb,s,best,1,0,0,2,\nc,s,best,1,0,1,2,MeshError: open\n")
    assert read_searches(file) == [TimedSearch("a", "s", "best", "classic", 1, 0.5, 2.0)]


def test_ranker_files_of_the_same_name_count_as_one_ranker(tmp_path: Path) -> None:
    file = tmp_path / "widths.csv"
    file.write_text(f"{HEAD},ranker\na,s,best,1,9,0.5,2,,f0/urank.onnx\nb,s,best,1,9,0.5,2,,f1/urank.onnx\n")
    assert [found.ranker for found in read_searches(file)] == ["urank", "urank"]


def test_a_file_that_is_no_table_of_searches_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "widths.csv"
    with pytest.raises(UserError, match="cannot be read"):
        read_searches(file)
    file.write_text("mesh,share\na,1\n")
    with pytest.raises(UserError, match="has no column settings, method, width, core_s"):
        read_searches(file)
    for figures in ("wide,9,0.5,2", "1,9,nan,2", "1,9,0.5,inf", "1,9"):
        file.write_text(f"{HEAD}\na,s,best,{figures},\n")
        with pytest.raises(UserError, match="cannot be read"):
            read_searches(file)
    file.write_text(f"{HEAD}\n")
    assert not read_searches(file)
    file.write_text("")
    with pytest.raises(UserError, match="has no column mesh, settings"):
        read_searches(file)


def test_a_model_that_one_ranker_searched_twice_is_named() -> None:
    with pytest.raises(UserError, match="a was searched twice with learned at width 2"):
        compare([search("a", "learned", 2, 0.5), search("a", "learned", 1, 0.5), search("a", "learned", 2, 0.4)])
