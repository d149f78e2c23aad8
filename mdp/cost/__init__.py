"""Cost: the price of a decomposition in mm2 of blemished surface, in total and per face.

`cost.CostTerms` holds the terms; `forecast.Forecast` predicts the cost and the parts of a sequence of planes without cutting.
"""
