"""The calibration piece: what a print of `demo:calibration` shows of where the rotary axes are.

`pads` are what a program of it prints where, `readings` what a person reads off them, `fit` the axes that explain that, and
`page` is what the readings are typed on.
"""
