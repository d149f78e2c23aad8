"""Open bench: what the pages of all benches are told of each, so that one leads to another."""

from dataclasses import dataclass


@dataclass(frozen=True)
class OpenBench:
    """Its number, its model's name, how many parts that is cut into (0: not yet), and the work under way in a word."""

    number: int
    name: str
    parts: int
    work: str
