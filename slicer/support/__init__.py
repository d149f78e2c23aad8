"""Support: where it may stand, how it grows down, how thick it is, its beads, why a place gets none. Public: support.own_supports."""
