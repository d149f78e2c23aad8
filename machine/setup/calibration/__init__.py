"""Calibration: signs, zeros and centres of the rotary axes from a few touches of one mark on the table.

`program` plans the touches and writes the G-code that goes to them, `sheet` is what a person notes, `fit` finds the numbers and
the tables of a profile that hold them. `probing` measures a ball instead of a mark, `piece` reads a printed piece.
"""
