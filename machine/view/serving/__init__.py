"""Serving: pages for this computer alone, at an address that contains a token."""
