"""Cost: what a person pays for a decomposition, in mm2 of blemished surface, whole and by the face.

`cost.CostTerms` says what counts, `forecast.Forecast` what a sequence of planes would leave and what its parts would be, without
a cut.
"""
