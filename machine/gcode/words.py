"""Words: parses a G-code command into words of letter and number, or a macro into KEY=VALUE.

The dry run's reader, the host and the simulated printer all use it. Letters are capitals: callers convert them.
"""

import re

Word = tuple[str, float]

PAUSE_REMARK = ";PAUSE:"  # after a command that waits for the user: gives the reason, and makes a sender pause by itself

NUMBER = r"[-+]?(?:[0-9]{1,12}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})(?![0-9])"  # bounded: no infinity from a thousand digits
BLOCK = re.compile(rf"(?:[A-Z] *{NUMBER} *)*")
WORD = re.compile(rf"([A-Z]) *({NUMBER})")
FLAGS = re.compile(rf"[GM] *[0-9]+(?:\.[0-9]+)? *(?:[A-Z] *(?:{NUMBER} *)?)*")
FLAG = re.compile(rf"([A-Z]) *({NUMBER})?")
MACRO = re.compile(r"(?![A-Z][-+.0-9])[A-Z_][A-Z0-9_]+(?: .*)?")
COMMAND = re.compile(r"([GMTSPR]) *0*([0-9]{1,9}(?:\.[0-9]{1,6})?)")  # S P R: Marlin's real-time orders, S000
VALUE = re.compile(r"([A-Za-z_][A-Za-z0-9_]*) *= *(\"[^\"]*\"|\S*)")
_number = re.compile(NUMBER).fullmatch
_spaced = re.compile(rf"(?: +[A-Z]{NUMBER})*\s*").fullmatch


def read_words(text: str) -> list[Word]:
    """The words with a number, in order; as in Marlin an E is never an exponent. Numbers that are too long are skipped."""
    if _spaced(text):  # the usual line: splitting at blanks is faster
        return [(word[0], float(word[1:])) for word in text.split()]
    return [(letter, float(value)) for letter, value in WORD.findall(text)]


def read_letters(text: str) -> list[str]:
    """The letters of the words, with a number or without: G28 X Y."""
    return [letter for letter, _ in FLAG.findall(text)]


def read_values(text: str) -> dict[str, str]:
    """KEY=VALUE of a macro: keys in capitals, values as written, without quotes."""
    return {key.upper(): value.strip('"') for key, value in VALUE.findall(text)}


def read_number(text: str) -> float | None:
    """A text as a number, or None."""
    return float(text) if _number(text) else None


def split_command(text: str) -> tuple[str, str]:
    """Name and rest of a command: "G1", " X5" of "G01X5"; a macro keeps its whole name."""
    if text[2:3] == " " and text[1:2].isdigit():
        return text[:2], text[2:]
    head = COMMAND.match(text)
    if head:
        return f"{head[1]}{head[2]}", text[head.end() :]
    name, _, rest = text.partition(" ")
    return name, rest


def quote(text: str) -> str:
    """A line quoted for a message."""
    return repr(text if len(text) <= 40 else text[:40] + "...")
