"""Support need: which faces that overhang cannot do without support along a direction, one definition for search and slicer.

`need.SupportNeed` is for all directions of a search, `need.needs_support` for one part. Faces that overhang and hang together are
a patch; where the solid goes down beside its rim, far enough to hold a line, the rim is an anchor.

      ____________            the underside of a deck is a patch between two anchors: lines span it where they are short enough;
     |  |      |  |___        the ledge beside it has one anchor, so nothing spans it, but lines no further than two widths from
     |  |      |  |           that hold on to their neighbours; what begins in mid-air needs support whatever its size
"""
