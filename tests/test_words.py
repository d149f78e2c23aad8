"""Docstrings, comments and messages use the words of CONTRIBUTING.md's glossary, and not those in WORDS."""

import ast
import io
import re
import tokenize
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = ("mdp", "slicer", "profiles", "machine")
PACKAGES = (*PROGRAM, "tools", "tests")
SETTINGS = ("simple", "advanced", "rare")  # their second argument: words of other programs, by which a setting is found
# Words and constructions to avoid -> what to write instead. Matched in each paragraph, ignoring case except in (?-i:).
WORDS = {
    r"\btold\b|\btells?\b(?!: )": "given, reported, distinguishes",
    r"\basked for\b": "requested, required",
    r"\blook(s|ed) at\b": "examined, considered",
    r"\bso many\b": "a number, a count",
    r"(?-i:^(Of|What|Whose)\b)": "a noun phrase: the part of, the faces above",
    r"\bgo(es)? on\b|\bwent on\b": "continue, proceed",
    r"\bwork(s|ed)? out\b": "compute, derive",
    r"\bany more\b": "no longer",
    r"\bin the place of\b": "in place of",
    r"\b(take|takes|taken|took) (it |them )?away\b": "remove",
    r"\bthe \w+ before(?=[.,;:)]|$)": "the previous",
    r", for (it|they|there|nothing|no|such)\b": "because",
    r"\bhears? of\b|\bheard of\b|\bheeds?\b": "receive, notice, handle",
    r"\b(lies?|stands?|turned|laid|cut) otherwise\b": "differently",
    r"\bfor want of\b": "without, for lack of",
    r"^The same\b": "the subject itself: a docstring is read alone",
    r"\bfrom (here|there|now|then|that|this|it|where it \w+) on\b": "from here, after that, at or above",
    r"\bthat \w+ \w+ leaves to\b": "the rest, the remainder",
    r"\bas costs? least\b": "the cheapest",
    r"\bh(e|is|im)\b": "the user, they",
    r"\bpersons?\b": "user",
    r"\b(some|no)body\b|\bwhoever\b": "the user, another process, no one",
    r"(?-i:\b[Pp]latforms?\b)": "build plate",
    r"\bstairs\b": "stair-stepping",
    r"\bscar(s|red)?\b(?! minimises)": "blemish",
    r"\bcrumbs?\b": "fragment",
    r"\bhairs?\b": "sliver",
    r"\bshut\b(?! down)": "blocked, closed",
    r"\blets? go\b": "release, discard",
    r"\bhand(s|ed)? down\b": "from an earlier part, pass on",
    r"\blaid down\b|\blying so\b": "oriented, placed on the plate",
    r"\bto and fro\b": "back and forth",
    r"\banew\b": "again",
    r"\bairy\b": "over air, unoccluded",
    r"\bmends?\b": "repair, fix, replace",
    r"(?<!there )\b(is|are) no (?!\w+er\b|more\b|less\b|such\b|room\b)": "is not a, are not",
    r"\bby way of\b": "through, via",
    r"\brubbish\b|\bhopeless\b": "garbled bytes; unavoidable",
    r"\bwhat stands\b": "the bodies beside, the print",
    r"\b(answers?|improves?|comes?|goes|follows?|moves?) no more\b": "no longer",
    r"\bof the \w+ have (one|two|no|none)\b": "a subject: turns have one point",
    r"\bgoing on\b|\bgone on\b": "continue, proceed",
    r"\bmended\b|\bparted\b": "repaired, split",
    r"\bdoes not tell\b": "does not say, state or report",
}

PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "tools/RESULTS.md")] + sorted((ROOT / "docs").glob("*.md"))
BEGINNING = re.compile(r"(^|[.:|] |\*\* ?|^[-*] )(Of|What|Whose|The same) ")  # of a sentence, a cell or a bold text
CODE = re.compile(r"`[^`]*`|\w+(?:/\w+)*\.cpp")  # names are checked where they are defined


def words_of(source: str) -> Iterator[tuple[int, str]]:
    """The paragraphs of a file's docstrings and comments, each as one line, with the number of its first line."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
            text := ast.get_docstring(node)
        ):
            for paragraph in re.sub(r"^>>> .*?(\n\n|\Z)", "", text, flags=re.DOTALL | re.MULTILINE).split("\n\n"):
                yield node.body[0].lineno, " ".join(paragraph.split())
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string.lstrip("# ")


def messages_of(source: str) -> Iterator[tuple[int, str]]:
    """The texts of a file that the program may print: strings with a space, on one line, with the number of their line."""
    tree = ast.parse(source)
    quiet = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in SETTINGS:
            quiet |= {id(synonyms) for synonyms in node.args[1:]}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip() and id(node) not in quiet:
            yield node.lineno, " ".join(node.value.split())


def findings(source: str, texts: Callable[[str], Iterator[tuple[int, str]]] = words_of) -> list[str]:
    """A line for every banned word in texts of a file, with what to write instead."""
    return [
        f"{number}: {match[0]!r}: write {instead}"
        for number, text in texts(source)
        for pattern, instead in WORDS.items()
        for match in re.finditer(pattern, CODE.sub("``", text), re.IGNORECASE)
    ]


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_and_comments_use_the_words_of_the_glossary(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    found = [f"{file.relative_to(ROOT)}:{line}" for file in files for line in findings(file.read_text(encoding="utf-8"))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("package", PROGRAM)
def test_messages_use_the_words_of_the_glossary(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    found = [f"{file}:{line}" for file in files for line in findings(file.read_text(encoding="utf-8"), messages_of)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ('"""It was told."""\nraise UserError(f"{name} is no file any more")', 2),
        ('x = advanced("Seam", "scar of a cut")(1.0, "width of the scar")', 1),
        ('TOLD = "told"', 0),
    ],
)
def test_the_check_finds_words_in_messages_only(source: str, count: int) -> None:
    assert len(findings(source, messages_of)) == count


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ('"""The line before, for it goes on.\n\n>>> told()\n\'told\'\n\nCalls `tell()`."""', 3),
        ('"""Of a model, its faces."""', 1),
        ('"""A model.\n\nThe same as\nso many faces."""', 2),
        ("def f(): ...  # what he was\n\nx = 'told'", 1),
        ('"""Whether the plane cuts the part; there is no part if not."""\nx = "platform"', 0),
        ('class A:\n    """A part that is no solid."""', 1),
    ],
)
def test_the_check_finds_words_in_docstrings_and_comments_only(source: str, count: int) -> None:
    assert len(findings(source)) == count


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_sentence_of_a_page_begins_with_of_what_whose_or_the_same(page: Path) -> None:
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert [line for line in lines if BEGINNING.search(line)] == []


def test_the_glossary_has_one_line_for_each_of_its_terms_in_alphabetical_order() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    terms = re.findall(r"^- \*\*(.+?)\*\*: ", text.partition("## Glossary")[2].partition("\n## ")[0], re.MULTILINE)
    assert len(terms) >= 60
    assert terms == sorted(set(terms), key=str.lower)
