"""A pause: where the tip waits, and how it gets there and back.

`pause.Pause` is one from its begin to its end; `park_moves` plans the way aside, and the way back past what is
printed.
"""
