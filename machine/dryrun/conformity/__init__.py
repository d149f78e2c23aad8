"""Conformity: the deposited plastic held against the model it was made from.

`agreement.agreement` asks `deposit` (what lies outside) and `filling` (what is filled), and finds what lies aside.
"""
