"""Demand: what of a part's support has to be built with the parts before it, from the last part to the first."""
