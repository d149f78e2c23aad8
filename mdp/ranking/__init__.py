"""Feasible cuts, their value, and the order in which a search makes them.

`node.Node` is the remainder after some cuts. `candidates` scores and checks planes, a `ranking.CandidateTable` holds the
candidates of one node, `ranking` and `ranker.ranker_named` order them, and `record.Trace` records them.
"""

SUFFIX = ".onnx"  # suffix of a trained ranker's file
