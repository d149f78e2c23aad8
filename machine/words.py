"""Words: one line of G-code taken apart into letters and numbers."""

import re

from profiles.errors import GcodeError

NUMBER = r"[-+]?(?:[0-9]{1,12}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})(?![0-9])"  # bounded: no infinity from a thousand digits
BLOCK = re.compile(rf"(?:[A-Z] *{NUMBER} *)*")
WORD = re.compile(rf"([A-Z]) *({NUMBER})")
FLAGS = re.compile(rf"[GM] *[0-9]+(?:\.[0-9]+)? *(?:[A-Z] *(?:{NUMBER} *)?)*")
FLAG = re.compile(rf"([A-Z]) *({NUMBER})?")
MACRO = re.compile(r"(?![A-Z][-+.0-9])[A-Z_][A-Z0-9_]+(?: .*)?")
PAREN = re.compile(r"\([^)]*\)")


def unframed(number: int, code: str) -> str:
    """A line without its N number and checksum; GcodeError when the checksum does not fit."""
    body, star, given = code.partition("*")
    if star:
        total = 0
        for byte in body.encode("utf-8", "replace"):
            total ^= byte
        if given.strip() != str(total):
            raise GcodeError(f"line {number}: {shown(code)} has checksum {given.strip()[:8]!r}, its characters give {total}")
    return re.sub(r"^N *[0-9]+ *", "", body.strip())


def shown(text: str) -> str:
    """A line as a message quotes it."""
    return repr(text if len(text) <= 40 else text[:40] + "...")
