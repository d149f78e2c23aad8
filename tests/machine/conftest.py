"""What the tests of the workbench's page have, each file its own: a browser and a workbench."""

from collections.abc import Iterator

import pytest

from tests.machine.browser import CHROMIUM, Browser
from tests.machine.workbench import QUICK, Running, workbench

WINDOW = (900, 560)  # a small picture: without a graphics card the processor draws it


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed: the page is not tried in a browser")
    with Browser(WINDOW) as running:
        yield running


@pytest.fixture(scope="module")
def bench() -> Iterator[Running]:
    with workbench(*QUICK) as running:
        yield running
