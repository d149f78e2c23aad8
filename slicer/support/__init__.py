"""Support: its possible area, its growth downward, its beads, and reasons for missing support. Public: support.own_supports."""
