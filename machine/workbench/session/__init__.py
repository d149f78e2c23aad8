"""Session: benches with the work under way for them and the pages that look at them.

Public: `session.Workbench`, `session.Session`, `base.Derived`, and `commands`, the table of what a page may ask for.
"""
