"""Calibration: signs, zeros and centres of the rotary axes from a few touches of one mark on the table.

`program` plans the touches and writes the G-code that goes to them, `sheet` is what a person notes, `fit.calibrate` finds the
numbers, `saved` puts them into a profile. `probing` measures a ball instead of a mark, `piece` reads a printed piece.
"""
