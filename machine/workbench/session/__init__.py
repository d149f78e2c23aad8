"""Session: benches with their running tasks and the pages that show them.

Public: `session.Workbench`, `session.Session`, `base.Derived`, and `commands`, the table of page commands.
"""
