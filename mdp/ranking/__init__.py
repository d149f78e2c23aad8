"""Which cuts are possible, what they are worth, and in what order a search takes them."""
