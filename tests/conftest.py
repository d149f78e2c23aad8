"""What every test stands on: laws that draw the same examples on every run, and an environment that is always the same.

A commit is judged by itself and not by luck: no example has a deadline and no drawing of examples a time limit, for a busy
machine is no fault of a law; what the person or the service that runs the tests has set for colours, widths, settings or
interrupts does not count. Compiled modules are kept beside their sources whatever that person wants: the suite starts
hundreds of programs, and each would compile all it imports again.

`pytest --hypothesis-profile=explore` draws new examples: run it a few times when a law's code was changed.
"""

import gc
import os
import signal
import sys

import pytest
from hypothesis import HealthCheck, settings

from machine.cli.start import SELDOM

# What shapes messages, and what turns on or off what a program shows; a terminal's own words are the test's to say.
SHAPING = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "PYTHONWARNINGS")

for name in (*SHAPING, "PYTHONDONTWRITEBYTECODE"):
    os.environ.pop(name, None)
sys.dont_write_bytecode = False
gc.set_threshold(*SELDOM)

# A shell ignores SIGINT for what it starts in the background, nohup SIGHUP: commands that tests start would inherit it.
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else lambda *_: None)
signal.pthread_sigmask(signal.SIG_UNBLOCK, signal.valid_signals())

LARGEST = ("slice", "judge", "sweep", "search", "dry-run", "draw")  # the bundles of kernels by the time that compiling takes
SLOW_IS_NO_FAULT = (HealthCheck.too_slow,)
settings.register_profile("repeatable", derandomize=True, deadline=None, suppress_health_check=SLOW_IS_NO_FAULT)
settings.register_profile("explore", print_blob=True, deadline=None, suppress_health_check=SLOW_IS_NO_FAULT)
settings.load_profile("repeatable")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Before the whole suite is shared out, kernels are compiled, each once: the workers would all compile the same ones."""
    shares_out = getattr(session.config.option, "numprocesses", None) and not hasattr(session.config, "workerinput")
    if shares_out and session.config.args_source is pytest.Config.ArgsSource.TESTPATHS:
        from machine.pipeline.compilers import wait_for

        wait_for(LARGEST)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """What is collected stays to the end: no search for garbage, of which each run of the pipeline makes two, goes through it,
    which takes 0.6 s where all tests are there."""
    gc.freeze()


@pytest.fixture(autouse=True, scope="session")
def _folders_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Logs, journals and settings are not those of the person who runs the tests."""
    monkeypatch = pytest.MonkeyPatch()
    for kind in ("STATE", "CONFIG"):
        monkeypatch.setenv(f"XDG_{kind}_HOME", str(tmp_path_factory.mktemp(kind.lower())))
