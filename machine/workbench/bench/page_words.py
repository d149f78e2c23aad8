"""Renders the marks of a message (see profiles/messages.py) in the words of the workbench's page.

A key is shown by its label, an option by the field that does the same.
"""

import re
from typing import Any

from profiles.frozen import unit_of
from profiles.messages import rendered
from profiles.profile import label_of, labels

NUMBER = re.compile(r"[+-]?\d+(\.\d*)?")
# By the name of a mark. An option has two texts, without and with its value; a phrase has one.
OPTIONS = {
    "--as-is": ("Undo", ""),
    "--baud": ("the baud rate", "the baud rate {}"),
    "--copies": ("Copies", "{} copies"),
    "--filament-change": ("a filament change", "the filament change at {}"),
    "--part": ("the settings of a part", "the settings of part {}"),
    "--parts": ("the number of parts", "the number of parts {}"),
    "--pause": ("a pause", "the pause at {}"),
    "--plan": ("the plan", "the plan {}"),
    "--plate": ("the plate", "plate {}"),
    "--port": ("the port", "{}"),
    "--ranker": ("the ranking", "Search ranking {}"),
    "--sim-speed": ("the speed of the simulated printer", ""),
    "advice --filament-change": ("a filament change", "{} under Copies and pauses"),
    "advice --pause": ("a pause", "{} under Copies and pauses"),
    "advice --baud": ("choose the baud rate", "choose the baud rate {}"),
    "advice --parts": ("choose another number of parts", "choose {} parts"),
}
PHRASES = {
    "again": "try again",
    "calibration": "(measure them; for the axes there is the command tiltprint calibrate)",
    "another baud rate": "try another baud rate",
    "another plate": "choose another one below",
    "compiling": "getting ready (first run only)",
    "cut by hand": "to cut it all the same, add a plane under Parts and move it where you like",
    "for all": "set it for all parts",
    "force": "tick Continue anyway to print it",
    "found by the search": "leave the part out of the plan and use Find the others",
    "compiled": "getting ready: {} steps done",
    "hand over": "or tick Upload only",
    "homed as in": "under Machine profile",
    "homed as in names": "Machine profile names",
    "its baud rate": "its baud rate",
    "machine of those": "choose one of these machines under Settings",
    "offset": "the offset is {} mm",
    "protected": "protected area {}",
    "page": "{}",
    "one part": "choose 1 part under Parts",
    "settings": "Settings",
    "": "",
}


def page_words(message: str) -> str:
    """The message with the page's fields in place of options, and labels in place of keys.

    >>> from profiles.messages import advice, key_name
    >>> page_words(f"{key_name('process.walls')} is -3: it must be a whole number from 0 to 50")
    'Walls is -3: it must be a whole number from 0 to 50'
    >>> page_words(f"4 parts would save 21 mm² of visible marks but take 12 min longer: {advice('parts', 4)}")
    '4 parts would save 21 mm² of visible marks but take 12 min longer: choose 4 parts'
    """
    return rendered(message, _words)


def in_page_words(value: Any) -> Any:
    """Apply page_words() to all texts in nested lists and dicts; other values are unchanged."""
    if isinstance(value, str):
        return page_words(value)
    if isinstance(value, dict):
        return {key: in_page_words(inner) for key, inner in value.items()}
    return [in_page_words(inner) for inner in value] if isinstance(value, list | tuple) else value


def _words(name: str, value: str, terminal: str) -> str:
    """The page's text for a mark, or the terminal's if the page has no such field."""
    if name.endswith("--set") and "=" in value:
        key, _, given = value.partition("=")
        given = f"{100.0 * float(given):.12g} %" if unit_of(key) == "%" and NUMBER.fullmatch(given) else given
        return f"set {label_of(key)} to {given}" if name.startswith("advice") else f"{label_of(key)} = {given}"
    if name in OPTIONS:
        bare, with_value = OPTIONS[name]
        return with_value.format(value) if value and with_value else bare
    return PHRASES[name].format(value) if name in PHRASES else label_of(name) if name in labels() else terminal
