"""Projects of other slicers: the volumes that are printed, and the marks and modifiers that the others become.

`printed.printed` takes negative volumes out, `marks.marks` makes modifiers and marks; `mdp.formats.project` is what a file says.
"""
