"""The dry run: any G-code read back through the machine's kinematics: timeline, findings, deposited plastic."""

from machine.dryrun.dryrun import DryRun, dry_run, summary
from machine.dryrun.findings import Finding

__all__ = ["DryRun", "Finding", "dry_run", "summary"]
