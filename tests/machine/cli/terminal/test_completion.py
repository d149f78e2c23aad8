"""Shell completion."""

import os
import subprocess
import sys

import pytest

from profiles.places import known


def _offered(words):
    asked = {"_TILTPRINT_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)}
    command = [sys.executable, "-m", "machine.cli.cli"]
    done = subprocess.run(command, env=os.environ | asked, capture_output=True, text=True, timeout=60, check=False)
    return done.stdout.split()


def test_commands_are_completed():
    assert _offered("tiltprint deco") == ["decompose"]


def test_names_of_machines_are_completed():
    assert _offered("tiltprint export a.stl --machine open5x") == [name for name in known("machine") if name.startswith("open5x")]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_for_the_shell_is_shown(shell):
    command = [sys.executable, "-m", "machine.cli.cli", "--show-completion", shell]
    named = os.environ | {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}  # else the shell that runs the tests is detected
    done = subprocess.run(command, env=named, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert f"_TILTPRINT_COMPLETE=complete_{shell}" in done.stdout
