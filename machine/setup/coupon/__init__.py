"""Coupons: small bars, each with a joint made after a turn of the table, that tell what holds when they are broken.

`bars` is their outline and what a load says of their strength, `design` which settings each is printed with, `plate` where they
stand, `sheet` what a person notes, `fit` what follows from it, `report` the table that others can compare with.
"""
