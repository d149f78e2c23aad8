"""The pipeline: the stages joined, from a model to its program and its dry run, and what is compiled for them beforehand.

`pipeline.decompose_model` and `pipeline.build` are the way of a model, `programs.load_program` that of a model or a G-code
file.
"""
