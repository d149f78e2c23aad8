"""Travel: the order of a layer's beads and the ways between them. Public: order.order_beads."""
