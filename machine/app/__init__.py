"""The program: joins the stages and talks to people.

`cli.main` parses and dispatches, `requests` are what the commands are asked for, `output` writes whole files or none.
"""
