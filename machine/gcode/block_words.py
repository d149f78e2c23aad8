"""Block words: which lines of a G-code block a firmware refuses, or takes without what they are meant to do."""

from collections.abc import Iterator, Sequence

from machine.firmware.dialect import Dialect
from machine.gcode.words import FLAG, MACRO, PAREN

HEATING = ("M104", "M109", "M140", "M190")
OTHER_WORD = {"S": "P", "P": "S"}  # what a temperature stands behind in the other kind of firmware
WITH_E = {"G76", "M66", "M67", "M68"}  # the commands of CNC programs that use an E
EXPRESSION = frozenset("#[<%")  # of CNC programs, which are not read here


def refused_lines(lines: Sequence[str], dialect: Dialect) -> Iterator[str]:
    """The filled-in lines of a block that are not in the firmware's words."""
    for line in lines:
        text = PAREN.sub(" ", line.partition(";")[0]).strip().upper()
        if text and text.split()[0] not in dialect.statements and not _is_known(text, dialect):
            yield line


def _is_known(text: str, dialect: Dialect) -> bool:
    if MACRO.fullmatch(text):
        return dialect.macros
    if not dialect.bare_words and (text[0] in "/O" or EXPRESSION & set(text)):
        return True
    words = FLAG.findall(text)
    named = [f"{letter}{float(number):g}" for letter, number in words if letter in "GM" and number]
    letters = {letter for letter, _ in words}
    if dialect.lacks & {*named} or (named and named[0] in HEATING and letters == {"M", OTHER_WORD[dialect.value_word]}):
        return False
    return dialect.bare_words or (all(number for _, number in words) and ("E" not in letters or bool(WITH_E & {*named})))
