"""Commands that measure the machine: where its axes are, what its joints hold."""
