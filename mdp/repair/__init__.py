"""Repair: surfaces read from model files become one closed solid, see `repair.repair`."""
