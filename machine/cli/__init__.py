"""The command line: what a person types and reads at a terminal.

`cli.main` parses and dispatches, `commands` holds a file for each command, `terminal` what is shown and how keys are read.
"""
