"""Truncated or damaged answers of a firmware: a machine is found in them, or they are refused in one sentence."""

import random

import pytest

from machine.setup.detect.found import ConfigText
from machine.setup.detect.proposal import read
from profiles.errors import ProfileError
from tests.machine.setup.detect.test_grblhal import DUMP
from tests.machine.setup.detect.test_klipper import GIMBAL, REGISTRATION, STEPPERS
from tests.machine.setup.detect.test_linuxcnc import AXES, INI
from tests.machine.setup.detect.test_marlin import LOG
from tests.machine.setup.detect.test_reprapfirmware import CRADLE, SPEEDS, model

WHOLE = {
    "klipper": STEPPERS + GIMBAL.partition("#*#")[0] + REGISTRATION,
    "linuxcnc": INI + AXES,
    "grblhal": DUMP,
    "marlin": LOG,
    "config.g": CRADLE + SPEEDS,
    "model": model(),
}
SIGNS = ("", "\n", "[", "]", '"', "9999", "-", "1e999", "{", "}", ":", "=", "M203 ", "$", "\0", "nan", "null")


def damaged(text: str, rng: random.Random) -> str:
    text = text[: rng.randrange(len(text))] if rng.random() < 0.3 else text
    for _ in range(rng.randrange(1, 6)):
        place = rng.randrange(len(text) + 1)
        text = text[:place] + rng.choice(SIGNS) + text[place + rng.randrange(4) :]
    return text


@pytest.mark.parametrize("name", WHOLE)
def test_damage_is_survived_or_refused_in_one_sentence(name: str) -> None:
    assert read(ConfigText(name, WHOLE[name])).axes["X"]
    rng, sentences = random.Random(name), []
    for _ in range(150):
        try:
            read(ConfigText(name, damaged(WHOLE[name], rng)))
        except ProfileError as error:
            sentences.append(str(error))
    assert 0 < len(sentences) < 150
    assert not any("\n" in sentence for sentence in sentences)
