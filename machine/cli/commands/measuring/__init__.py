"""Commands that measure the machine: the positions of its axes, the strength of joints."""
