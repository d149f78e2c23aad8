"""ProbingRules: how a firmware is told to seek contact along Z, and how it says where that was."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ProbingRules:
    """{low} is the Z to go down to at most, mm, {speed} mm/s, {feed} mm/min.

    contact: pattern of the answer with the tip's Z at contact; "": M114 is asked where the tip has stopped, at {low} when
    nothing was met. corrected: pattern of an answer whose Z the firmware has corrected by the probe's offset that it knows
    itself. limited: {low} is kept; otherwise it goes on to the axis' end. silent: what it says when nothing was met; early: when
    the probe senses something before it moves. needs: what it must be built or set up with.
    """

    command: str
    needs: str
    contact: str = ""
    corrected: str = ""
    limited: bool = True
    silent: str = ""
    early: str = ""
