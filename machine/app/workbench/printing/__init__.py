"""Printing: prints that the workbench has started, each in a process of its own, and the page that commands it."""
