"""Commands: one function each, which returns an exit code and never sees the parser.

`print.print_model`, `resume.resume`, `view.view`: a module bears the name of its command.
"""
