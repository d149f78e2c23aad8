from pathlib import Path

import pytest

from mdp.learning.evaluation.widths import Search, compare, read_searches
from profiles.errors import LearningError

HEAD = "mesh,settings,method,width,risky_mm2,share,core_s,error"


def search(mesh: str, ranker: str, width: int, share: float) -> Search:
    return Search(mesh, "", "best", ranker, width, share, 2.0 * width)


def test_series_are_means_over_the_models_that_all_searches_have() -> None:
    both = [search(mesh, "learned", 1, share) for mesh, share in (("a", 0.2), ("b", 0.4), ("c", 0.9))]
    plain = [search(mesh, "classic", width, 0.5 / width) for mesh in ("a", "b") for width in (2, 1)]
    (comparison,) = compare([*both, *plain])
    classic, learned = comparison.series
    assert (comparison.models, classic.ranker, learned.ranker) == (2, "classic", "learned")
    assert (classic.widths, classic.share, classic.core_s) == ((1, 2), (0.5, 0.25), (2, 4))
    assert learned.share == pytest.approx((0.3,))


def test_models_without_a_risky_face_and_failed_searches_do_not_count(tmp_path: Path) -> None:
    table = tmp_path / "widths.csv"
    table.write_text(f"{HEAD}\na,s,best,1,9,0.5,2,\nb,s,best,1,0,0,2,\nc,s,best,1,0,1,2,MeshError: open\n")
    assert read_searches(table) == [Search("a", "s", "best", "classic", 1, 0.5, 2.0)]
    table.write_text(f"{HEAD},ranker\na,s,best,1,9,0.5,2,,learned\n")
    assert read_searches(table)[0].ranker == "learned"


def test_a_table_that_is_none_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "widths.csv"
    with pytest.raises(LearningError, match="cannot be read"):
        read_searches(table)
    table.write_text("mesh,share\na,1\n")
    with pytest.raises(LearningError, match="has no column settings, method, width, core_s"):
        read_searches(table)
    table.write_text(f"{HEAD}\na,s,best,wide,9,0.5,2,\n")
    with pytest.raises(LearningError, match="cannot be read"):
        read_searches(table)
