"""Pictures: of a decomposition, of every number of parts, in a G-code file's head.

`raster.draw` draws meshes without a display; `picture`, `front_picture` and `png` make of it what the commands write.
"""
