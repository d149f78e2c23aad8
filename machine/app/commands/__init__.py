"""Commands: one function each, which returns an exit code and never sees the parser."""
