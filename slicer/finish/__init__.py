"""Finish: sizes that come out as the model has them, and smooth tops."""
