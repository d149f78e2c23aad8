"""Property tests draw the same examples on every run, so that a commit is judged by itself and not by luck.

`pytest --hypothesis-profile=explore` draws new ones: run it a few times when a law's code was changed.
"""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("explore", print_blob=True)
settings.load_profile("repeatable")
