"""Shared by the makers of docs: places of pages and pictures, generated parts of a page, and browsers."""

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.machine.browser import Browser

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def marked(text: str, name: str, made: Callable[[re.Match[str]], str]) -> str:
    """A page with the text between `<!-- NAME -->` and `<!-- end -->` replaced; name is a pattern."""
    pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    return pattern.sub(lambda match: match[1] + made(match) + match[match.re.groups], text)


@contextmanager
def clean_browser(size: tuple[int, int], mobile: bool = False) -> "Iterator[Browser]":
    """A browser for light-theme pictures, without earlier work and printers."""
    from tests.machine.browser import Browser

    with tempfile.TemporaryDirectory() as state, Browser(size) as browser:
        os.environ["XDG_STATE_HOME"] = state
        browser.resize(*size, mobile=mobile)
        browser.prefer("light")
        yield browser
        print(f"complaints: {browser.complaints or 'none'}")
