"""The terminal: options, progress, reports, keys, the live screen."""
