"""From a part to layers of paths in the part's own frame."""
