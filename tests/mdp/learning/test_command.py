from collections.abc import Sequence

import pytest

from mdp.learning.command import run
from profiles.errors import UserError


@pytest.mark.parametrize(
    ("wrong", "code", "sentence"),
    [
        (UserError("record a: is torn"), 1, "error: record a: is torn\n"),
        (ModuleNotFoundError("no", name="torch"), 1, "error: torch is not installed; in a clone: pip install -e '.[train]'\n"),
        (KeyboardInterrupt(), 130, "interrupted; begin anew\n"),
    ],
)
def test_a_user_error_ends_in_one_sentence(
    wrong: BaseException, code: int, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def command(arguments: Sequence[str] | None) -> None:
        raise wrong

    assert run(command, [], "begin anew") == code
    assert capsys.readouterr().err == sentence


def test_a_command_that_ends_well_has_exit_code_0() -> None:
    assert run(lambda arguments: None, [], "") == 0
