"""G-code: words and modes, the writer, arcs, blocks, the comments at a file's head and foot.

`writer.write_gcode` writes a program. `words` and `modes.Modes` are the one reading of G-code, for the dry run's reader, the
sender (`modes.ModalState`) and the simulated printer.
"""
