"""Workbench: the program's window in the browser: what is on it, the commands, the long work and the server."""
