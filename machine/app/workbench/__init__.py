"""Workbench: the program's window in the browser: the bench, the long work, the sessions and the server."""
