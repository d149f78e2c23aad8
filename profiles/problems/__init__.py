"""All problems of a profile at once: of a table by itself, and of what only several profiles know together."""
