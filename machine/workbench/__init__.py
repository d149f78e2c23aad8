"""Workbench: the program's window in the browser.

Rooms, each above what it imports: `bench` the values, `work` what takes time, `session` a bench with the work for it, `printing`
what is printed, `access` who is answered, `web` the server and the page. `web.serve.serve_workbench` runs it.
"""
