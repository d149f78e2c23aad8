"""The terminal: options, progress, reports, keys, the live screen.

`progress.say` and `plain.show` are how anything is said, on stderr and as a result.
"""
