import pytest

from machine.app import progress
from machine.app.progress import PLAIN_AGAIN_S, PLAIN_EVERY_S, Ticker


def test_a_log_hears_of_what_changes_every_five_seconds_and_of_what_does_not_once_a_minute(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = [(1.0, "a"), (PLAIN_EVERY_S, "a"), (3 * PLAIN_EVERY_S, "a"), (4 * PLAIN_EVERY_S, "b"), (2 * PLAIN_AGAIN_S, "b")]
    clock = iter([0.0, *(now for now, _ in said)])
    monkeypatch.setattr(progress, "monotonic", lambda: next(clock))
    ticker = Ticker()
    for _, text in said:
        ticker.tick(text)
    assert capsys.readouterr().err == "a\nb\nb\n"
