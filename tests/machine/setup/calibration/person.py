"""Simulated keyboard input for input()."""


class Person:
    """A user who types these lines, then Ctrl-C."""

    def __init__(self, *lines: str) -> None:
        self.lines, self.asked = list(lines), list[str]()

    def __call__(self, prompt: str) -> str:
        self.asked.append(prompt)
        if not self.lines:
            raise KeyboardInterrupt
        return self.lines.pop(0)
