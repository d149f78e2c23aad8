"""Coupons: small bars, each with a joint made after a turn of the table, that tell what holds when they are broken.

`bars` is their outline and what a load says of their strength, `design` which settings each is printed with and the sheet that a
person fills in, `plate` where they stand, `fit` what follows from the loads.
"""
