"""Interface: what a part is beside the others: where it lies on them, what they cover of it, how they hold together."""
