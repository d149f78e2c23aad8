"""The pages of figures have the form that their readers expect: few words, and a figure with its source for every claim."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README, RESULTS, BENCHMARK = (ROOT / name for name in ("README.md", "tools/RESULTS.md", "docs/benchmark.md"))
QUESTIONS = {
    section.partition("\n")[0]: section.partition("\n")[2]
    for section in re.split(r"^## ", RESULTS.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
}
LIST = "What did not help"


def words(text: str) -> int:
    return len(text.replace("|", " ").split())


def tables(text: str) -> list[list[list[str]]]:
    """The cells of each table, row by row, without its head."""
    found = re.findall(r"^\|(?:-+:?\|)+\n((?:\|.*\n)*)", text.replace(":-", "-"), re.MULTILINE)
    return [[[cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines()] for table in found]


def test_results_has_twelve_questions_and_one_list_of_what_did_not_help() -> None:
    assert list(QUESTIONS)[-1] == LIST
    assert len([title for title in QUESTIONS if title.endswith("?")]) == len(QUESTIONS) - 1 == 12


@pytest.mark.parametrize("question", [title for title in QUESTIONS if title != LIST])
def test_a_question_has_one_table_a_command_and_at_most_150_words_of_text(question: str) -> None:
    lines = QUESTIONS[question].splitlines()
    assert len(tables(QUESTIONS[question])) == 1
    assert words("\n".join(line for line in lines if not line.startswith("|"))) <= 150
    assert "`" in QUESTIONS[question]


def test_the_pages_stay_within_their_limits_of_words() -> None:
    assert words(README.read_text(encoding="utf-8")) <= 1_100
    assert words(RESULTS.read_text(encoding="utf-8")) <= 4_000
    assert sum(words(page.read_text(encoding="utf-8")) for page in ROOT.glob("docs/*.md")) <= 20_000


def test_each_claim_of_the_comparison_in_readme_has_a_figure_and_its_source() -> None:
    text = README.read_text(encoding="utf-8")
    rows = tables(text[text.index("## What is different") :])[0]
    assert len(rows) >= 7
    for title, ours, _ in rows:
        assert re.search(r"\d", re.sub(r"\]\([^)]*\)", "", ours)), title
        assert re.search(r"\]\((docs|tools)/", title + ours), title


def test_each_model_of_the_benchmark_is_published_in_every_way() -> None:
    text = BENCHMARK.read_text(encoding="utf-8")
    whole, published, shapes = tables(text)
    models = {row[0] for row in whole}
    assert len(models) == 21
    assert all(all(row[1:4]) for row in whole)
    assert models - {row[0] for row in published} == {"mechanical part", "Y 30°"}
    assert all(all(row) for row in published)
    assert {row[0] for row in shapes} <= models
