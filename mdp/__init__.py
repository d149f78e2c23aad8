"""tiltprint: from a mesh to an ordered sequence of parts, each with its own printing direction."""
