"""The processes that compile kernels in a first run, and the command that waits for them."""

import sys

import pytest

from machine.pipeline.compilers import Compilers
from machine.pipeline.precompile import BUNDLES
from mdp.kernels.cache import mark


@pytest.fixture
def unmarked(monkeypatch, tmp_path):
    """Nothing counts as cached, and records are written elsewhere."""
    monkeypatch.setattr("mdp.kernels.cache.mark", lambda bundle: tmp_path / bundle)
    return tmp_path


def test_a_bundle_that_was_waited_for_is_not_compiled_again(unmarked, capsys):
    compilers = Compilers()
    compilers.wait_for(["dry-run"])
    assert (unmarked / "dry-run").exists()
    assert "compiling the kernels, once, for the first run that needs them" in capsys.readouterr().err
    Compilers().wait_for(["dry-run"])
    assert capsys.readouterr().err == ""


def test_a_log_names_the_compilation_once(unmarked, monkeypatch, capsys):
    monkeypatch.setattr("machine.notices.PLAIN_EVERY_S", 0.0)
    compilers = Compilers()
    for bundle in ("dry-run", "draw"):
        compilers.wait_for([bundle])
    assert capsys.readouterr().err.count("compiling the kernels") == 1


def test_work_continues_if_no_process_can_be_started(unmarked, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    Compilers().wait_for(["judge"])
    assert not (unmarked / "judge").exists()


def test_work_continues_if_no_interpreter_is_found(unmarked, monkeypatch):
    monkeypatch.setattr(sys, "executable", str(unmarked / "python"))
    Compilers().wait_for(["judge"])
    assert not (unmarked / "judge").exists()


def test_every_bundle_has_its_own_mark():
    assert len({mark(bundle) for bundle in BUNDLES}) == len(BUNDLES)
