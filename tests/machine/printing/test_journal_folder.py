"""The journals of the state folder: no content ends a list with a traceback, and a running print is not offered."""

import json
import os
import signal
import subprocess
import sys
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from typing import Any
from zlib import crc32

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.cli.cli import main
from machine.cli.commands.print import list_resumable
from machine.gcode.lines import GcodeFile
from machine.link.journal import BLOCK_BYTES, FORMAT, SLOTS
from machine.printing.destination import SerialPort
from machine.printing.job import Does, PrintJob
from machine.printing.journal_folder import new_journal, resumable_journals
from machine.printing.resumption import read_resumption
from profiles.errors import UserError
from profiles.folders import state_folder
from profiles.profile import load

LINES = [f"G1 X{x} F600" for x in range(50)]
PROFILE = load().model_dump(mode="json")
SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9) | st.sampled_from(["\0", "\ud800", "x" * 999])
)
ODD = st.recursive(SCALARS, lambda inner: st.lists(inner, max_size=7) | st.dictionaries(st.text(max_size=9), inner), max_leaves=9)
KEYS = ("format", "key", "boot", "program", "sha256", "name", "profile", "more")
STATES = ODD | st.lists(ODD, min_size=7, max_size=7) | st.just([1, 20, 20, 10, 20, [], "printing"])
DEEP = b"[" * 100_000


def record(value: Any, size: int = 0) -> bytes:
    text = (value if isinstance(value, bytes) else json.dumps(value).encode()).ljust(size - 10)
    return b"%08x %s\n" % (crc32(text), text)


def is_no_bug(content: bytes) -> None:
    """A journal of this content is listed or left out, and resumed or refused in a sentence."""
    journal = state_folder() / "journals" / "odd.journal"
    journal.parent.mkdir(exist_ok=True)
    journal.write_bytes(content)
    with redirect_stdout(StringIO()):
        assert list_resumable() == 0
    json.dumps([entry.name for entry in resumable_journals()])
    with suppress(UserError):
        read_resumption(PrintJob(SerialPort("/dev/none"), Does.RESUME, cut_off=journal))
    journal.unlink()


@given(key=st.sampled_from(KEYS), of_profile=st.sampled_from(("", *PROFILE)), value=ODD, state=STATES)
def test_a_journal_with_anything_at_all_in_its_heading_or_state_ends_nothing_with_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, key: str, of_profile: str, value: Any, state: Any
) -> None:
    program = tmp_path_factory.getbasetemp() / "p.gcode"
    program.write_text("\n".join(LINES))
    changed = PROFILE | {of_profile: value} if key == "profile" and of_profile else value
    heading = {
        "format": FORMAT,
        "key": "odd",
        "boot": "",
        "program": str(program),
        "sha256": GcodeFile(program).sha256(),
        "name": "odd",
        "profile": PROFILE,
    }
    is_no_bug(record(heading | {key: changed}) + SLOTS * record(state, BLOCK_BYTES))


@pytest.mark.parametrize(
    "content", [bytes(3_000_000), record(DEEP), record([]) * 9, record({})[:-1], record(b"\xff"), record(b"[1")]
)
def test_a_file_that_is_no_journal_ends_nothing_with_a_traceback(content: bytes) -> None:
    is_no_bug(content)


def test_a_journal_is_not_offered_and_not_thinned_out_before_its_print_has_ended_or_died(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    prints = (
        "import time; from machine.printing.journal_folder import new_journal; from machine.link.journal import Checkpoint;"
        "from profiles.profile import load; journal = new_journal(['G28'] * 50, load(), 'long');"
        "journal.write(Checkpoint(20, 20, 10, 20)); print(journal.path, flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", prints], stdout=subprocess.PIPE, text=True) as printing:
        assert printing.stdout is not None
        path = printing.stdout.readline().strip()
        assert path not in [str(entry.path) for entry in resumable_journals()]
        assert main(["resume", path, "--port", "/dev/none", "--yes"]) == 1
        running = "its print runs now, in another terminal or page: it can be resumed when it has ended"
        assert running in capsys.readouterr().err.replace("\n", " ")
        for number in range(25):
            with new_journal(LINES, load(), f"{number}"):
                pass
        assert Path(path).exists()
        printing.send_signal(signal.SIGKILL)
    assert path in [str(entry.path) for entry in resumable_journals()]


def test_a_program_whose_journal_has_not_begun_yet_is_not_deleted() -> None:
    folder = state_folder() / "journals"
    folder.mkdir(exist_ok=True)
    begun, orphan = folder / "begun.journal.gcode", folder / "orphan.journal.gcode"
    for program in (begun, orphan):
        program.write_text("G28\n")
    os.utime(orphan, (0.0, 0.0))
    with new_journal(LINES, load(), "next"):
        pass
    assert begun.exists()
    assert not orphan.exists()


def test_a_program_named_by_a_new_journal_is_not_deleted(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = state_folder() / "journals"
    for number in range(25):
        with new_journal(LINES, load(), f"{number}"):
            pass
    oldest = min(folder.glob("*.journal"))
    program = next(path for path in folder.glob("*.gcode") if path.name.startswith(oldest.stem))

    def begin_another(path: Path) -> bool:  # like another process that resumes the oldest journal
        if not (folder / "further.journal").exists():
            (folder / "further.journal").write_bytes(oldest.read_bytes())
        return False

    monkeypatch.setattr("machine.printing.journal_folder.is_being_printed", begin_another)
    os.utime(program, (0.0, 0.0))
    with new_journal(LINES, load(), "next"):
        pass
    assert not oldest.exists()
    assert program.exists()
