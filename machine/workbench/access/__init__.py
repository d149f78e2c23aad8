"""Access: this computer's pages have a secret address, devices of the local network must be paired.

Public: `network.open_lan`, `pairing.Door` and `gate.Gate` for the network, `limits` for what a paired device may not request.
"""
