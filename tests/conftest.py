"""Property tests draw the same examples on every run, so that a commit is judged by itself and not by luck;
no example has a deadline, for a busy machine is no fault of a law.

`pytest --hypothesis-profile=explore` draws new ones: run it a few times when a law's code was changed.
"""

import signal

from hypothesis import settings

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a shell leaves it for what it starts in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", print_blob=True, deadline=None)
settings.load_profile("repeatable")
