"""A pause: where the tip waits, and how it gets there and back."""
