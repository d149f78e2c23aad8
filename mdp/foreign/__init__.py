"""Files of other slicers: the volumes that are printed, and the marks and modifiers that the others become.

`printed.printed` subtracts negative volumes, `marks.Marks` makes modifiers and marks of `mdp.formats.slicer_file.Build`.
"""
