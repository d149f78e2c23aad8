"""Contact: what stands on the table of a true machine, which may differ from its profile, and a probe that senses it."""
