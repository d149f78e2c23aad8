"""Calibration: signs, zeros and centres of the rotary axes from touches of one mark on the table.

`program` plans the touches and writes their G-code, `sheet` is the form for the readings, `fit` finds the numbers and the
profile's tables. `probing` measures a ball instead of a mark, `piece` evaluates a printed piece.
"""
