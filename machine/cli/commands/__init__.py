"""One module per command; each command is a function that returns an exit code and does not know the parser."""
