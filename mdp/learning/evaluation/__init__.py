"""Judging rankers: the paper's table, the analysis of its features, and its pictures."""
