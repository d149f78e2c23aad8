"""Shared by the makers of docs: places of pages and pictures, and generated parts of a page."""

import re
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def marked(text: str, name: str, made: Callable[[re.Match[str]], str]) -> str:
    """A page with the text between `<!-- NAME -->` and `<!-- end -->` replaced; name is a pattern."""
    pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    return pattern.sub(lambda match: match[1] + made(match) + match[match.re.groups], text)
