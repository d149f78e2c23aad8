"""G-code: words and modes, the writer, arcs, blocks, the comments at a file's head and foot."""
