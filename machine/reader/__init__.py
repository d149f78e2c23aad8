"""Reader: what a firmware would understand of a G-code text, command by command."""
