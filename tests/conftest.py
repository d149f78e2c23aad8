"""Property tests draw the same examples on every run, so that a commit is judged by itself and not by luck;
no example has a deadline, for a busy machine is no fault of a law.

`pytest --hypothesis-profile=explore` draws new ones: run it a few times when a law's code was changed.
"""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", print_blob=True, deadline=None)
settings.load_profile("repeatable")
