"""Questions: numbered M105 that show what has arrived when an answer is missing, and how many of them may stay unanswered.

The number is a NEW one each time: Marlin swallows a repeat of its last line without a word.
"""

from dataclasses import dataclass

QUESTION = "M105"
QUESTIONS_MOST = 4  # in a row without any answer before the printer counts as gone
IDLE_REPORTS = 2  # a printer that says twice in a row that it has nothing to do has lost the line in flight


@dataclass
class Questions:
    """unanswered: in a row; first: line number of the first one; implausible: the line that was asked for although it cannot
    be meant, 0: none.
    """

    unanswered: int = 0
    first: int = 0
    implausible: int = 0
    _idle_reports: int = 0

    def ask(self) -> bool:
        """Count one more; False when the printer has to be given up."""
        self.unanswered += 1
        return self.unanswered <= QUESTIONS_MOST

    def hear_idle(self, in_flight: bool) -> bool:
        """The printer says that it has nothing to do; whether that calls for a question."""
        self._idle_reports += 1
        if self._idle_reports < IDLE_REPORTS or not in_flight:
            return False
        self._idle_reports = 0
        return True

    def acknowledge(self) -> None:
        """A line or a question was answered."""
        self.unanswered = self._idle_reports = 0

    def end(self) -> None:
        """What has arrived is known."""
        self.unanswered = self.first = self.implausible = 0
