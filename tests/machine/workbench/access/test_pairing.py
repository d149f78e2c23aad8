"""Pairing of a device: codes from one state to the next, and the names of paired devices."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.workbench.access.pairing import LETTERS, WRONG_IN_ALL, Pairing, Verdict, device_name, fresh_code, grouped, judge

CODE, NEXT = "ABCD2345", "WXYZ6789"
OPEN = Pairing(CODE)
IPHONE = "Mozilla/5.0 (iPhone; CPU iPhone OS 17_5 like Mac OS X) AppleWebKit/605.1.15 (KHTML, like Gecko) Version/17.5 Mobile/15E148 Safari/604.1"  # noqa: E501
ANDROID = "Mozilla/5.0 (Linux; Android 10; K) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/126.0.0.0 Mobile Safari/537.36"
FIREFOX = "Mozilla/5.0 (X11; Linux x86_64; rv:127.0) Gecko/20100101 Firefox/127.0"
EDGE = "Mozilla/5.0 (Windows NT 10.0; Win64; x64) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/126.0.0.0 Safari/537.36 Edg/126.0"


def after_wrong(count: int) -> tuple[Pairing, list[Verdict]]:
    """The state after a number of wrong codes, each typed as soon as the delay after the previous one was over."""
    pairing, verdicts = OPEN, []
    for _ in range(count):
        pairing, verdict = judge(pairing, "no", pairing.waits_until_s, CODE)
        verdicts.append(verdict)
    return pairing, verdicts


@pytest.mark.parametrize("typed", ["ABCD2345", "abcd2345", "ABCD-2345", " abcd 2345 ", "ABCD2345\0"])
def test_the_code_pairs_as_people_type_it_and_is_used_up(typed: str) -> None:
    pairing, verdict = judge(OPEN, typed, 0.0, NEXT)
    assert (verdict, pairing) == (Verdict.PAIRED, Pairing(NEXT))
    assert judge(pairing, typed, 0.0, CODE)[1] == Verdict.WRONG


@pytest.mark.parametrize("typed", ["", "ABCD234", "ABCD23456", "ABCD2346", "\N{SNOWMAN}", "ＡBCD2345"])
def test_a_wrong_code_does_not_pair(typed: str) -> None:
    assert judge(OPEN, typed, 0.0, NEXT)[1] == Verdict.WRONG


def test_five_wrong_codes_replace_it_and_pairing_waits_longer_each_time() -> None:
    pairing, verdicts = after_wrong(5)
    assert verdicts == [Verdict.WRONG] * 4 + [Verdict.SPENT]
    assert pairing.waits_until_s == 30.0
    assert after_wrong(10)[0].waits_until_s == 30.0 + 60.0
    assert after_wrong(15)[0].waits_until_s == 30.0 + 60.0 + 120.0


def test_during_a_wait_the_right_code_is_ignored_and_no_wrong_one_counted() -> None:
    pairing, _ = after_wrong(5)
    assert judge(pairing, CODE, 29.9, NEXT) == (pairing, Verdict.WAITS)
    assert judge(pairing, "no", 29.9, NEXT) == (pairing, Verdict.WAITS)
    assert judge(pairing, CODE, 30.0, NEXT)[1] == Verdict.PAIRED


def test_twenty_wrong_codes_close_it_for_the_right_one_too() -> None:
    pairing, verdicts = after_wrong(20)
    assert verdicts[-1] == Verdict.CLOSED
    assert judge(pairing, pairing.code, 1e9, NEXT) == (pairing, Verdict.CLOSED)


def test_a_device_that_pairs_in_between_does_not_forget_what_was_counted() -> None:
    pairing, _ = after_wrong(4)
    pairing, verdict = judge(pairing, CODE, 0.0, NEXT)
    assert (verdict, pairing.wrong, pairing.wrong_in_all) == (Verdict.PAIRED, 0, 4)


@given(st.lists(st.tuples(st.booleans(), st.floats(0.0, 100.0)), max_size=120))
def test_at_most_twenty_wrong_codes_are_ever_checked(tries: list[tuple[bool, float]]) -> None:
    pairing, now_s, looked_at = OPEN, 0.0, 0
    for knows, passed_s in tries:
        now_s += passed_s
        after, verdict = judge(pairing, pairing.code if knows else "no", now_s, fresh_code())
        looked_at += verdict in (Verdict.WRONG, Verdict.SPENT) or (after.closed and not pairing.closed)
        assert (verdict == Verdict.PAIRED) <= (knows and not pairing.closed and now_s >= pairing.waits_until_s)
        assert after.wrong_in_all == looked_at <= WRONG_IN_ALL
        pairing = after


def test_codes_are_random_and_have_no_ambiguous_letters() -> None:
    codes = {fresh_code() for _ in range(200)}
    assert len(codes) == 200
    assert set("".join(codes)) <= set(LETTERS)
    assert not set("ILO01") & set(LETTERS)
    assert grouped("ABCD2345") == "ABCD-2345"


def test_the_representation_of_the_state_does_not_contain_the_code() -> None:
    assert CODE not in repr(OPEN)


@pytest.mark.parametrize(
    ("user_agent", "name"),
    [
        (IPHONE, "iPhone, Safari"),
        (ANDROID, "Android, Chrome"),
        (FIREFOX, "Linux, Firefox"),
        (EDGE, "Windows, Edge"),
        ("curl/8.5.0", "a device"),
        ("", "a device"),
        ("<script>iPad\x1b[2J", "iPad"),
    ],
)
def test_a_device_is_called_by_words_of_ours_alone(user_agent: str, name: str) -> None:
    assert device_name(user_agent) == name
