"""Handed down: what of a part's support has to be built with the parts before it. Public: plan.plan_supports."""
