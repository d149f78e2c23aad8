"""The pipeline: the stages joined, from a model to its program and its dry run, and what is compiled for them beforehand."""
