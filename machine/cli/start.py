"""Entry point of `tiltprint`, which handles Ctrl-C even before the command line is imported."""

import gc
import os
import signal
import sys
from contextlib import suppress
from importlib.util import find_spec

PACKAGES = ("profiles", "mdp", "slicer", "machine")  # names so common that other distributions use them, too
SIGN = b'"""tiltprint: '  # beginning of each package's __init__.py
SELDOM = (100_000, 20, 50)  # thresholds of garbage collection, raised because there are few reference cycles


def main() -> int:
    """Import the command line, run it and return the exit code."""
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115 - open as long as the program runs
    sys.stdout, sys.stderr = (stream or open(os.devnull, "w", encoding="utf-8") for stream in (sys.stdout, sys.stderr))  # noqa: SIM115
    gc.set_threshold(*SELDOM)
    os.environ.setdefault("NUMPY_MADVISE_HUGEPAGE", "0")  # memory that is hardly written to is not allocated
    try:
        if trouble := package_trouble():
            sys.stderr.write(f"tiltprint: {trouble}: install tiltprint into an environment of its own\n")
            return 1
        from machine.cli.cli import main as run

        code = run()
    except KeyboardInterrupt:
        sys.stderr.write("tiltprint: interrupted\n")
        code = 130
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C could only cause a traceback while Python shuts down
    if code == 130:
        from machine.cli.terminal.interrupts import leave

        leave(code)
    return code


def package_trouble() -> str:
    """Sentence about a package that is missing, overwritten or hidden by another distribution; "" if all are tiltprint's own."""
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


if __name__ == "__main__":
    raise SystemExit(main())
