"""The terminal: options, requests, reports, keys, the live screen."""
