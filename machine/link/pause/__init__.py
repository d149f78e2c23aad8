"""A pause: where the tip waits, and how it gets there and back.

`pause.Pause` is one from its begin to its end; `park_moves.plan_park` plans the way aside, `return_path.return_moves` the way
back past what is printed.
"""
