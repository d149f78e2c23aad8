"""Rankers that are learnt: the network of the paper and its training, others to hold it against, and its export."""
