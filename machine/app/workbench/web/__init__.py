"""The workbench's server, its page, and what the page is told."""
