"""Workbench: the program's window in the browser.

Rooms, from low to high: `bench` holds the values, `work` the long tasks, `session` a bench with its tasks, `printing` the prints,
`access` the access control, `web` server and page. `web.serve.serve_workbench` runs it.
"""
