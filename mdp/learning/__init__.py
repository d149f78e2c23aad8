"""Training and judging rankers from the records of wide searches: lists, labels, networks, their export, tables and pictures.

Everything here needs the extra `train`; a search needs only what `mdp.ranking` holds.
"""
