"""Support: where it may stand, how it grows down, its beads, why a place gets none. Public: support.own_supports."""
