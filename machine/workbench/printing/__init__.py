"""Printing: prints that the workbench has started, each in a process of its own, and the pages that command them.

Public: `prints.Prints`, and `commands`, the table of what a page may ask for.
"""
