"""Pictures: of a decomposition, of a layer, in a G-code file's head."""
