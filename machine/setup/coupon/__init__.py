"""Coupons: small bars with joints made after a turn of the table, broken to measure their strength.

`bars` is their geometry and the stress of a load, `design` their settings and the sheet for the loads, `plate` their arrangement,
`fit` the evaluation.
"""
