"""Setup of a machine: detection from its firmware, calibration of its axes, and coupons that measure its joints."""
