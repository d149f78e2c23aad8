"""Pairing: a code that is typed on a device, judged: from one state to the next, with the time given from outside.

Wrong codes are counted over all devices: an address can be forged, and shared. At most 20 of 31 ** 8 codes are ever tried.
"""

import secrets
from dataclasses import dataclass, field, replace
from enum import StrEnum

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"  # without I, L, O, 0 and 1, which look alike
CODE_LENGTH = 8
WRONG_OF_A_CODE, WRONG_IN_ALL = 5, 20
FIRST_WAIT_S = 30.0  # after the first code that was used up by wrong ones; doubled after every further one


class Verdict(StrEnum):
    """What becomes of a code that was typed. spent: wrong, and the code is another one now; waits, closed: not compared."""

    PAIRED = "paired"
    WRONG = "wrong"
    SPENT = "spent"
    WAITS = "waits"
    CLOSED = "closed"


@dataclass(frozen=True)
class Pairing:
    """code: the one that pairs next; wrong, wrong_in_all: how many others were typed since it is the code, and since pairing is
    open; waits: how often codes were used up; waits_until_s: codes are refused until then."""

    code: str = field(repr=False)
    wrong: int = 0
    wrong_in_all: int = 0
    waits: int = 0
    waits_until_s: float = 0.0

    @property
    def closed(self) -> bool:
        """Whether no device is paired any more."""
        return self.wrong_in_all >= WRONG_IN_ALL


def fresh_code() -> str:
    """A random code."""
    return "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))


def grouped(code: str) -> str:
    """A code as it is read: ABCD-EFGH."""
    return f"{code[: CODE_LENGTH // 2]}-{code[CODE_LENGTH // 2 :]}"


def judge(pairing: Pairing, typed: str, now_s: float, fresh: str) -> tuple[Pairing, Verdict]:
    """The state after a code was typed at a time, and what becomes of it. fresh: the code that follows one that is used up."""
    if pairing.closed:
        return pairing, Verdict.CLOSED
    if now_s < pairing.waits_until_s:
        return pairing, Verdict.WAITS
    if secrets.compare_digest(_plain(typed), pairing.code.encode()):
        return replace(pairing, code=fresh, wrong=0), Verdict.PAIRED
    after = replace(pairing, wrong=pairing.wrong + 1, wrong_in_all=pairing.wrong_in_all + 1)
    if after.closed:
        return replace(after, code=fresh), Verdict.CLOSED
    if after.wrong < WRONG_OF_A_CODE:
        return after, Verdict.WRONG
    wait_s = FIRST_WAIT_S * 2**after.waits
    return replace(after, code=fresh, wrong=0, waits=after.waits + 1, waits_until_s=now_s + wait_s), Verdict.SPENT


def _plain(typed: str) -> bytes:
    """What a person has typed, without the strokes and spaces between and in capitals."""
    return "".join(letter for letter in typed.upper() if letter.isalnum()).encode()
