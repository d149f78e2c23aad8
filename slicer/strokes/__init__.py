"""Strokes: the ordered beads of a layer, their seams, splits and speeds, and the travels between. Public: order.order_beads."""
