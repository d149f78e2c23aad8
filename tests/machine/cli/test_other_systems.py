"""Common commands where parts of POSIX are missing, as on Windows: terminals, forks, signals and a UTF-8 encoding."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.mdp import files
from tests.shapes import box

BARE = """
import os, signal, sys
for name in ("pty", "termios", "tty", "fcntl", "pwd", "grp", "resource", "readline"):
    sys.modules[name] = None
for module, names in (
    (os, ("openpty", "fork", "forkpty", "getpgrp", "tcgetpgrp", "geteuid", "sched_getaffinity", "killpg", "ttyname")),
    (signal, ("SIGUSR1", "SIGUSR2", "SIGHUP", "pthread_kill", "pthread_sigmask", "alarm")),
):
    for name in names:
        delattr(module, name)
import multiprocessing
multiprocessing.get_all_start_methods = lambda: ["spawn"]
"""
RUN = """
from machine.cli.cli import main
codes = []
for command in json.loads(sys.argv[1]):
    sys.stdout.write(f"== {command[0]}\\n")
    codes.append(main(command))
sys.stdout.write(f"codes {codes}\\n")
"""


@pytest.mark.slow
def test_the_common_commands_need_nothing_that_windows_lacks(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('inherits = "generic_ac"\n[machine]\nname = "own"\n')
    files.written(tmp_path / "box.off", box(10, 10, 4))
    commands = [
        ["profiles", "list"],
        ["profiles", "check", "own.toml"],
        ["decompose", "box.off", "-o", "parts"],
        ["export", "box.off", "-o", "a.gcode"],
        ["simulate", "a.gcode", "--machine", "own.toml"],
        ["view", "a.gcode", "-o", "a.html"],
        ["print", "a.gcode", "--port", "sim", "--journal", "j", "--log", "l"],
        ["ports"],
    ]
    environment = os.environ | {"PYTHONIOENCODING": "cp1252", "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, "-c", "import json" + BARE + RUN, json.dumps(commands)],
        cwd=tmp_path, env=environment, capture_output=True, encoding="cp1252",
    )  # fmt: skip
    assert done.stdout.splitlines()[-1:] == ["codes [0, 0, 0, 0, 0, 0, 0, 0]"], done.stderr
    assert "no serial port was found" in done.stderr
    assert {"a.gcode", "a.html", "parts", "j", "l"} <= {path.name for path in tmp_path.iterdir()}


def test_a_name_that_the_terminal_s_encoding_lacks_is_escaped(tmp_path: Path) -> None:
    (tmp_path / "模型.toml").write_text('inherits = "generic_ac"\n[machine]\nname = "own"\n', encoding="utf-8")
    command = [sys.executable, "-m", "machine.cli.cli", "profiles", "check", "模型.toml"]
    environment = os.environ | {"PYTHONIOENCODING": "cp1252", "PYTHONPATH": str(Path(__file__).parents[3])}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, encoding="cp1252")
    assert (done.returncode, done.stdout) == (0, "\\u6a21\\u578b.toml: no problem found\n")
