"""Interface: a part in relation to other parts: where it stands on them, what they cover of it, and how they hold together."""
