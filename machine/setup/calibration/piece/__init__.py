"""The calibration piece: what a print of `demo:calibration` shows of where the rotary axes are.

`pads` are what a program of it prints where, and what a person reads off them; `fit` finds the axes that explain that, or writes
the page on which the readings are typed.
"""
