"""Labels: what a person reads in place of a key of a profile, and the other words by which one looks for it.

Public: `labels.label_of`, `labels.group_title`.
"""
