"""Sweep: all offsets of one direction evaluated in one pass over the faces.

`sweep.gains` says what each plane makes safe, `sweep.sweep` whether it can be cut; both take a `sweep.Remainder`, the solid
laid out once.

      d ^    ________       h = vertex . d of every vertex. A face adds a piecewise quadratic in c to the area above the plane
        |   |  ____  |      h = c: wholly above, it goes into suffix sums; where it crosses sampled offsets it is added to those
      c +---|-|----|-|---   alone. So all offsets c together cost one look at every face and one at every crossing
        |   |_|    |_|
"""
