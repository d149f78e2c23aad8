"""Fixtures for each test file: a browser, a workbench, and an empty folder."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.machine.browser import CHROMIUM, PLAIN, Browser
from tests.machine.running_workbench import QUICK, Running, workbench

WINDOW = (900, 560)  # a small picture: without a graphics card the processor draws it
DENSITY = 0.5  # pixels for each CSS pixel, for the same reason


def small_browser(*flags: str) -> Browser:
    """A browser with a small window, which is quick to draw."""
    return Browser(WINDOW, (*PLAIN, *flags), DENSITY)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed: the page is not tried in a browser")
    with small_browser() as running:
        yield running


@pytest.fixture(scope="module")
def bench() -> Iterator[Running]:
    with workbench(*QUICK) as running:
        yield running


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder as the working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
