"""Session: benches with the work under way for them and the pages that look at them.

Public: `workbench.Workbench`, `session.Session`, and `commands`, the table of what a page may ask for.
"""
