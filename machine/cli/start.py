"""Start: what the command `tiltprint` runs; it knows Ctrl-C before the command line is loaded."""

import gc
import os
import signal
import sys
from contextlib import suppress
from importlib.util import find_spec

PACKAGES = ("profiles", "mdp", "slicer", "machine")  # names so common that other distributions have them too
SIGN = b'"""tiltprint: '  # how the first file of each package begins
SELDOM = (100_000, 20, 50)  # what is allocated between two looks for garbage in circles, of which there is little


def main() -> int:
    """Load the command line and run it; returns the exit code."""
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115 - for as long as the program runs
    sys.stdout, sys.stderr = (stream or open(os.devnull, "w", encoding="utf-8") for stream in (sys.stdout, sys.stderr))  # noqa: SIM115
    gc.set_threshold(*SELDOM)
    os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")  # what is hardly written to takes no memory
    try:
        if trouble := package_trouble():
            sys.stderr.write(f"tiltprint: {trouble}: install tiltprint into an environment of its own\n")
            return 1
        from machine.cli.cli import main as run

        code = run()
    except KeyboardInterrupt:
        sys.stderr.write("tiltprint: interrupted\n")
        code = 130
    with suppress(ValueError):  # in a thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done: Ctrl-C would only end in a traceback of Python's own end
    if code == 130:
        from machine.cli.terminal.interrupts import leave

        leave(code)
    return code


def package_trouble() -> str:
    """Which package is missing, or was overwritten or hidden by another distribution; "" if all are tiltprint's own."""
    for name in PACKAGES:
        spec = find_spec(name)
        if spec is None:
            return f"the package {name} is missing"
        folder = next(iter(spec.submodule_search_locations or ()), name)
        own = False
        with suppress(OSError), open(spec.origin or os.path.join(folder, "__init__.py"), "rb") as file:
            own = file.read(len(SIGN)) == SIGN
        if not own:
            return f"{folder} belongs to another program"
    return ""
