"""Other slicers' files: their printed volumes, and their marks and modifiers.

`printed.printed` subtracts negative volumes, `marks.Marks` turns those of `mdp.formats.slicer_file.Build` into zones of a plan.
"""
