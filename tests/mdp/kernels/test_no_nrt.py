"""Helpers without numba's runtime: forbidden operations, which would silently free an array twice or never."""

import ast
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[3]
NUMBERS = re.compile(r"None|bool|Segment|Point|Ramp|Vector|int|float|tuple\[(int|float)(, (int|float))*\]")
NUMERIC = (
    "abs",
    "arccos",
    "arctan2",
    "ceil",
    "cos",
    "degrees",
    "floor",
    "hypot",
    "radians",
    "rint",
    "sin",
    "sqrt",
    "int32",
    "uint32",
)


def test_no_helper_without_the_runtime_gives_an_array_back() -> None:
    helpers = _decorated("no_nrt")
    assert len(helpers) > 30
    given = {ast.unparse(function.returns) for function in helpers if function.returns}
    assert {name for name in given if not NUMBERS.fullmatch(name)} == set()


def test_helpers_without_the_runtime_call_no_others_and_make_no_array() -> None:
    helpers = _decorated("no_nrt")
    others = {function.name for kind in ("helper", "kernel") for function in _decorated(kind)}
    others -= {function.name for function in helpers}
    calls = {ast.unparse(node.func) for function in helpers for node in ast.walk(function) if isinstance(node, ast.Call)}
    assert calls & others == set()
    assert {call for call in calls if call.startswith("np.")} <= {f"np.{name}" for name in NUMERIC}


def _decorated(kind: str) -> list[ast.FunctionDef]:
    """All decorated functions of the packages."""
    return [function for function in _functions() if kind in map(ast.unparse, function.decorator_list)]


@cache
def _functions() -> list[ast.FunctionDef]:
    """All functions of the files that import the decorators."""
    paths = [path for package in ("mdp", "slicer", "machine") for path in (ROOT / package).rglob("*.py")]
    texts = [text for text in (path.read_text("utf-8") for path in paths) if "mdp.kernels.kernel" in text]
    return [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
