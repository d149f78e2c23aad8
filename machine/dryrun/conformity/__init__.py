"""Conformity: the deposited plastic held against the model it was made from.

`agreement.agreement` asks `deposit` (what lies outside), `filling` (what is filled) and `registration` (what lies aside).
"""
