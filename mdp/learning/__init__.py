"""Training and evaluation of rankers from the records of wide searches: lists, labels, networks, their export, tables and
figures.

Everything here needs the extra `train`; a search needs only `mdp.ranking`.
"""
