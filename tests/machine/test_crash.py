"""Crash reports: the message of a bug, also on a full disk."""

import errno
import os

import pytest

from machine import crash


def test_a_bug_on_a_full_disk_is_reported_without_its_log(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_given: object, **_options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(crash.tempfile, "NamedTemporaryFile", full)
    told = crash.bug_in_words(ValueError("no such thing"), ())
    assert told == "a bug in tiltprint: ValueError: no such thing; the details could not be written: no space left on device"
