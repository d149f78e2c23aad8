"""Conformity: the deposited plastic held against the model it was made from."""
