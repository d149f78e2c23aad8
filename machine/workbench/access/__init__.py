"""Access: who is answered: pages of this computer by the secret address, devices of the local network once they are paired.

Public: `network.open_lan`, `pairing.Door` and `gate.Gate` for the network, `limits`, what a paired device may not ask for.
"""
