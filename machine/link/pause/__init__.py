"""A pause: where the tip waits, and how it gets there and back.

`pause.Pause` runs it from beginning to end; `park_moves` plans the moves aside and back, clear of the print.
"""
