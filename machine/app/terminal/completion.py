"""Completion: what the shell offers where a name is typed: the profiles that ship and those of the user."""

from collections.abc import Callable


def names_of(kind: str) -> Callable[[str], list[str]]:
    """What completes the name of a profile of a kind: machine, material or process."""

    def complete(incomplete: str) -> list[str]:
        from profiles.places import known

        return [name for name in known(kind) if name.startswith(incomplete)]

    return complete
