"""Printing: prints started by the workbench, each in its own process, and the pages that control them.

Public: `prints.Prints`, and `commands`, the table of page commands.
"""
