"""Disk: what a journal needs of the file system.

`locks.lock` locks a file for as long as a process lives, `incomplete_mark` marks a journal that has lost a record.
"""
