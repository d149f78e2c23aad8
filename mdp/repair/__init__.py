"""Repair: surfaces as model files give them become one closed solid: `repair.repair`."""
