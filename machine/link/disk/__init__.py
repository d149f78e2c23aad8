"""Disk: how a journal that has lost a record is marked, so that nobody resumes from it: `incomplete_mark`."""
