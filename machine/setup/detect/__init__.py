"""Detection: reads a firmware's settings and proposes a profile.

A module for each firmware reads its texts into values with their sources (found); propose() applies them to the nearest shipped
machine. No I/O: the caller provides the text. What a text leaves open, such as which axis tilts, is refused, not guessed.
"""
