"""The dry run: any G-code read back through the machine's kinematics: timeline, findings, deposited plastic.

`dry_run` plays the lines, `summary` has its figures for `--json`; `agreement.agreement` holds the plastic against the model,
`starvation.find_starvation` a slow line against the moves, `dryrun.Timeline` tells where any line of the program is.
"""

from machine.dryrun.dryrun import DryRun, dry_run, summary
from machine.dryrun.findings import Finding

__all__ = ["DryRun", "Finding", "dry_run", "summary"]
