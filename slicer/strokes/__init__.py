"""Strokes: the beads of a layer in order, their seams, splits and speeds, and the ways between. Public: order.order_beads."""
