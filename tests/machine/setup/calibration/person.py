"""A person at the keyboard, for what asks by input()."""


class Person:
    """Someone who types these lines, then Ctrl-C."""

    def __init__(self, *lines: str) -> None:
        self.lines, self.asked = list(lines), list[str]()

    def __call__(self, prompt: str) -> str:
        self.asked.append(prompt)
        if not self.lines:
            raise KeyboardInterrupt
        return self.lines.pop(0)
