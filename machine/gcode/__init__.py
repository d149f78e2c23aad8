"""G-code: words and modes, the writer, arcs, blocks, the comments at a file's head and foot.

`writer.write_gcode` writes a program. The dry run's reader, the sender (`modes.ModalState`) and the simulated printer all parse
G-code by `words` and `modes.Modes`.
"""
