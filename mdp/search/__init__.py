"""Search: from a mesh to its ordered parts, by a beam of cuts."""
