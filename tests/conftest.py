"""Shared test setup: hypothesis draws the same examples in every run, and the environment is fixed.

A commit is judged by its content, not by luck: examples have no deadline and drawing them has no time limit, because a busy
machine breaks no law. The user's settings of colours, widths and interrupts are ignored. Compiled modules are cached beside their
sources whatever the user has set: the suite starts hundreds of programs, and each would compile all its imports again.

`pytest --hypothesis-profile=explore` draws new examples: run it a few times after changing the code that a law covers.
"""

import gc
import os
import signal
import sys

import pytest
from hypothesis import HealthCheck, settings

from machine.cli.start import SELDOM

# Variables that change the format of messages or what a program displays; a test sets those of its own terminal itself.
SHAPING = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "PYTHONWARNINGS")

for name in (*SHAPING, "PYTHONDONTWRITEBYTECODE"):
    os.environ.pop(name, None)
sys.dont_write_bytecode = False
gc.set_threshold(*SELDOM)

# A shell ignores SIGINT for background jobs, nohup ignores SIGHUP: commands that tests start would inherit it.
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else lambda *_: None)
signal.pthread_sigmask(signal.SIG_UNBLOCK, signal.valid_signals())

LARGEST = ("slice", "judge", "sweep", "search", "dry-run", "draw")  # bundles of kernels, the slowest to compile first
SLOW_IS_NO_FAULT = (HealthCheck.too_slow,)
settings.register_profile("repeatable", derandomize=True, deadline=None, suppress_health_check=SLOW_IS_NO_FAULT)
settings.register_profile("explore", print_blob=True, deadline=None, suppress_health_check=SLOW_IS_NO_FAULT)
settings.load_profile("repeatable")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels once before the whole suite is distributed: otherwise all workers would compile the same ones."""
    shares_out = getattr(session.config.option, "numprocesses", None) and not hasattr(session.config, "workerinput")
    if shares_out and session.config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        from machine.pipeline.compilers import wait_for

        wait_for(LARGEST)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Exclude collected tests from garbage collection: each pipeline run collects twice, and scanning all tests takes 0.6 s."""
    gc.freeze()


@pytest.fixture(autouse=True, scope="session")
def _folders_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keep logs, journals and settings out of the user's folders."""
    monkeypatch = pytest.MonkeyPatch()
    for kind in ("STATE", "CONFIG"):
        monkeypatch.setenv(f"XDG_{kind}_HOME", str(tmp_path_factory.mktemp(kind.lower())))
