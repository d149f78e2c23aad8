"""Calibration: signs, zeros and centres of the rotary axes from a few touches of one mark on the table."""
