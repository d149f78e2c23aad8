"""Support need: which overhanging faces require support along a direction, defined once for search and slicer.

`need.SupportNeed` is for all directions of a search, `need.needs_support` for one part. Connected overhanging faces are a patch;
where the solid beside its rim continues far enough downward to hold a line, the rim is an anchor.

      ____________            the underside of a deck is a patch between two anchors: lines span it where they are short enough;
     |  |      |  |___        the ledge beside it has one anchor, so nothing spans it, but lines no further than two widths from
     |  |      |  |           that hold on to their neighbours; a floating start needs support whatever its size
"""
