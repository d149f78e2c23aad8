"""Page words: a sentence of the program, which speaks to a terminal, as the workbench's page says it.

Sentences are made once, below, and name options and keys; here alone they get the page's own fields and labels. What a person has
named himself, as a file, stays to the letter, even where its name is made of keys and options: in doubt a key is shown as it is.
"""

import re
from collections.abc import Iterable
from functools import lru_cache
from itertools import count
from pathlib import PurePath
from typing import Any

from profiles.frozen import TITLES
from profiles.profile import SECTIONS
from profiles.wording import keys

LABELS = {key: field.title or "" for section, model in SECTIONS.items() for key, field in keys(model, f"{section}.")}
# The label of a key that a sentence names without its table: of several the process's own.
_NAMES = [(*key.split("."), label) for key, label in LABELS.items() if not key.startswith("machine.")]
_BARE = {name: text for section, name, text in sorted(_NAMES, key=lambda named: named[0] == "process") if "_" in name}
_PAUSES = "under Copies and pauses"
# Option or aside -> what the page has in its place; the first that fits goes first.
RULES = (
    (r" \(simulate lists all, --force goes on\)", " (tick Go on all the same to print it nevertheless)"),
    (r"--force goes on", "tick Go on all the same to print it nevertheless"),
    (r"; going on because of --force", "; going on all the same"),
    (r" ?\(--force\)", ""),
    (r"--parts (\d+): (the search found|the plan has|.* no more than)", r"\1 parts were asked for: \2"),
    (r": --parts 1 prints it in one piece", ": take 1 under In how many parts"),
    (r": --parts (\d+)", r": take \1 under In how many parts"),
    (r"and --parts N takes it", "and another number can be taken under In how many parts"),
    (r"--parts (is )?(\d+)", r"the number of parts \1\2"),
    (r"--copies is", "Copies is"),
    (r"--copies (\d+)", r"\1 copies"),
    (r"--pause (\d+:[\d.]+(?:mm)?)(?=[, (]|$)", r"the pause at \1"),
    (r"--filament-change (\d+:[\d.]+(?:mm)?)(?=[, (]|$)", r"the filament change at \1"),
    (r"--(pause|filament-change) (\S+): ", rf"\2 {_PAUSES}: "),
    (r"--part \d+:", "its own "),
    (r"--plate prints another: ([\d, ]+)", r"another can be taken below: \1"),
    (r"--plate (\d+): that plate", r"plate \1"),
    (r"; profiles import lists them", ""),
    (r"--ranker ([^:]*): ", r"Ranked as \1: "),
    (r"give --set (\S+)=([\d.e+-]+)", r"set \1 to \2"),
    (r": --set (\S+?)=\.\.\. sets it", ": set it for all parts"),
    (r"--set (\S+?)=(\S+)", r"\1 = \2"),
    (r"use --baud (\d+)", r"choose the baud rate \1"),
    (r"try --baud", "try the baud rate"),
    (r"is --baud the", "is the baud rate the"),
    (r"its rate for --baud", "its baud rate"),
    (r"--baud N tries another", "try another baud rate"),
    (r"--sim-speed is", "the speed of the simulated printer is"),
    (r"--port (\S+) is a", r"\1 is a"),
    (r"--port sim: ", ""),
    (r"send without --start hands a file over meanwhile", "tick Only hand the file over meanwhile"),
    (r"(and )?name that( profile)? with --machine", r"\1name that\2 under Homed as in"),
    (r"--machine must be one of those, as", "take a machine of those under Settings, as"),
    (r"--machine gives", "Homed as in names"),
    (r"; resume can be tried again|(?<=: when it has come to rest), resume can be tried again", ", try it again"),
    (r": decompose --planes \S+ finds it", ": leave the part out of the plan and have it found by Find the others"),
    (r" \((?:criterion [IV]+|\[\[keep\]\])\)", ""),
    (r"--as-is keeps it", "Undo keeps it"),
    (r"`profiles show` lists them", "Settings lists them"),
    (r"\boffset_mm is (-?[\d.]+)", r"the offset is \1 mm"),
    (r"\boffset_mm must be at least (-?[\d.]+), it is (-?[\d.]+)", r"the offset must be at least \1 mm, it is \2 mm"),
    (r"(?<=\d) deg C\b", " °C"),
    (r"compiling the kernels \(only the first run that needs them does\)", "getting ready (only the first run needs to)"),
    (r"compiling the kernels: (\d+) done", r"getting ready: \1 steps are done"),
    (r"\bmm2\b", "mm²"),
    (r"\bmm3\b", "mm³"),
)
_RULES = [(re.compile(pattern), replacement) for pattern, replacement in RULES]
_TINY = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?e-(?:0[4-9]|[1-9]\d)(?= mm| deg| °)")
_KEY = re.compile(r"(?<![\w./\[-])(?:process|material|machine|search)(?:\.[a-z][a-z0-9_]*)+(?![\w.]*[\w])")
_WORD = re.compile(r"(?<![\w./-])(?:" + "|".join(sorted(map(re.escape, _BARE), key=len, reverse=True)) + r")(?![\w/-]|\.\w)")
# What a sentence quotes, or gives as the value of an option, is somebody's own, too.
_VALUES = (
    r"(?<!\w)'[^'\n]*'(?!\w)|(?<!\w)\"[^\"\n]*\"(?!\w)"
    r"|(?<=--ranker )[^:]*(?=: )|(?<=--port )\S+(?= is a)|(?<=\w=)[A-Za-z_][^\s,;:)]*"
)
_FIRST_STAND_IN = 0xF0000  # private use: in no rule, and a letter of nothing


def page_words(sentence: str, names: Iterable[str] = ()) -> str:
    """The sentence with the page's fields in the place of options, labels in that of keys, and nothing smaller than can be seen.

    names: of models, files, machines and the like that it may speak of, which stay as they are, also by the last part of a path
    alone and without the suffix.

    >>> page_words("process.walls is -3: it must be a whole number from 0 to 50")
    'Walls is -3: it must be a whole number from 0 to 50'
    >>> page_words("4 parts would save 21 mm2 of scars but take 12 min longer: --parts 4")
    '4 parts would save 21 mm² of scars but take 12 min longer: take 4 under In how many parts'
    >>> page_words("infill_density 2.stl: infill_density is 3", ["infill_density 2.stl"])
    'infill_density 2.stl: Infill density is 3'
    """
    kept: dict[str, str] = {}
    free = (chr(number) for number in count(_FIRST_STAND_IN) if chr(number) not in sentence)

    def stand_in(own: re.Match[str]) -> str:
        kept[letter := next(free)] = own[0]
        return letter

    rewritten = _rewritten(_own(sentence, tuple(names)).sub(stand_in, sentence))
    return "".join(kept.get(letter, letter) for letter in rewritten) if kept else rewritten


def _own(sentence: str, names: tuple[str, ...]) -> re.Pattern[str]:
    """Where a sentence has something of a person's own: the longest names first, and none inside of a longer word."""
    called = "|".join(re.escape(name) for name in _at_risk(names) if name in sentence)
    return re.compile(rf"(?<![\w.])(?:{called})(?!\w)|{_VALUES}" if called else _VALUES)


@lru_cache(maxsize=64)
def _at_risk(names: tuple[str, ...]) -> tuple[str, ...]:
    """All forms of names in which a rule may find something, the longest first."""
    forms = {form for name in names for form in (name, PurePath(name).name, PurePath(name).stem) if _is_at_risk(form)}
    return tuple(sorted(forms, key=len, reverse=True))


def _is_at_risk(name: str) -> bool:
    """Whether a rule may find something in a name, or begin in it."""
    return any(letter in name for letter in "_-([`") or _rewritten(f"1 {name}") != f"1 {name}"


def _rewritten(sentence: str) -> str:
    for pattern, replacement in _RULES:
        sentence = pattern.sub(replacement, sentence)
    sentence = _KEY.sub(_label, _TINY.sub("less than 0.001", sentence))
    if "placeholder" in sentence:  # of a block of G-code, which are called as keys
        return sentence
    return _WORD.sub(lambda word: _BARE[word[0]], sentence)


def in_page_words(value: Any, names: Iterable[str] = ()) -> Any:
    """All sentences of plain values, in lists and tables, too, as the page says them; what is no text stays."""
    if isinstance(value, str):
        return page_words(value, names)
    if isinstance(value, dict):
        return {key: in_page_words(inner, names) for key, inner in value.items()}
    return [in_page_words(inner, names) for inner in value] if isinstance(value, list | tuple) else value


def with_page_words(table: dict[str, Any], keys: Iterable[str], names: Iterable[str] = ()) -> dict[str, Any]:
    """A table with the sentences of these keys as the page says them."""
    return table | {key: in_page_words(table[key], names) for key in keys if key in table}


def _label(key: re.Match[str]) -> str:
    label = LABELS.get(key[0])
    if label is None:
        return key[0]
    table = key[0].rpartition(".")[0]
    return f"{TITLES[table]}: {label}" if table.count(".") else label
