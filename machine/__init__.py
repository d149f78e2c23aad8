"""tiltprint: from sliced parts to machine moves, G-code, the dry run and the printer."""
