"""Which cuts are possible, what they are worth, and in what order a search takes them.

`node.Node` is what remains after some cuts. `candidates` scores and checks planes, a `ranking.CandidateTable` holds
those of one node, `ranking` and `ranker.ranker_named` order them, `record.Trace` puts them on record.
"""

SUFFIX = ".onnx"  # of a trained ranker's file
