"""Start: what the command `tiltprint` runs; it knows Ctrl-C before the command line is loaded."""

import gc
import os
import signal
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("profiles", "mdp", "slicer", "machine")  # names so common that other distributions have them too
SELDOM = (100_000, 20, 50)  # what is allocated between two looks for garbage in circles, of which there is little


def main() -> int:
    """Load the command line and run it; returns the exit code."""
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115 - for as long as the program runs
    sys.stdout, sys.stderr = (stream or open(os.devnull, "w", encoding="utf-8") for stream in (sys.stdout, sys.stderr))  # noqa: SIM115
    gc.set_threshold(*SELDOM)
    os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")  # what is hardly written to takes no memory
    if folder := foreign_package():
        sys.stderr.write(f"tiltprint: {folder} belongs to another program: install tiltprint into an environment of its own\n")
        return 1
    try:
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


def foreign_package() -> str:
    """The folder of a package that another distribution has overwritten or hides; "" if all packages are tiltprint's own."""
    for name in PACKAGES:
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            return name
        if not Path(spec.origin).read_bytes().startswith(b'"""tiltprint: '):
            return str(Path(spec.origin).parent)
    return ""
