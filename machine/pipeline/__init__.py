"""Pipeline: the stages joined, from a model to its program and dry run, and the kernels compiled beforehand.

`pipeline.decompose_model` and `pipeline.build` process a model, `programs.load_program` a model or a G-code file.
"""
