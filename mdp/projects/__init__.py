"""Projects of other slicers: what of one is printed, and which of our own marks its other volumes are.

`printed.printed` takes negative volumes out, `marks.marks` makes modifiers and marks; `mdp.formats.project` is what a file says.
"""
