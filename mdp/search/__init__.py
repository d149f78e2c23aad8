"""Search: from a mesh to its ordered parts, by a beam of cuts.

`search.decompose` searches, `search.cut_by_plan` cuts as a plan says, `orient.orient_and_decompose` chooses orientation and
parts together, `trial.Trials` tries planes moved by hand; `problem.Problem` is what a search holds fixed, `node.Node` what
remains after some cuts.
"""
