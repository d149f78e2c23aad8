"""The command line.

`cli.main` parses and dispatches, `commands` has one module per command, `terminal` holds options, reports and keys.
"""
