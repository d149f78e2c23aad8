"""Detection: what a firmware says of its machine, and the profile that follows from it.

A file for each firmware reads its texts into values with their sources (found); propose() puts them over the nearest shipped
machine. No I/O: the caller has the text. What a text leaves open, as which axis tilts, is refused and not guessed.
"""
