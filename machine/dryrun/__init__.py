"""Dry run: plays any G-code through the machine's kinematics: timeline, findings, deposited plastic.

`dry_run` plays the lines, `summary` gives the figures for `--json`; `agreement.agreement` compares the plastic with the model,
`starvation.find_starvation` checks a slow line, `dryrun.Timeline` gives the position at any line.
"""

from machine.dryrun.dryrun import DryRun, dry_run, summary
from machine.dryrun.findings import Finding

__all__ = ["DryRun", "Finding", "dry_run", "summary"]
