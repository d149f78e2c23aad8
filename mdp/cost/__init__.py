"""Cost: what a person pays for a decomposition, in mm2 of blemished surface, whole and by the face.

`cost.CostTerms` says what counts, `cost.measure_seam` what a seam takes, `forecast.Surface` what a sequence of planes would
leave and `part_forecast.forecast_parts` what its parts would be, without a cut.
"""
