"""Which cuts are possible, what they are worth, and in what order a search takes them.

`candidates` scores and checks planes, a `candidate_table.CandidateTable` holds those of one node, `ranking` and
`ranker.ranker_named` order them, `record.Trace` puts them on record.
"""

SUFFIX = ".onnx"  # of a trained ranker's file
