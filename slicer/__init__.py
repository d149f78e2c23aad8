"""tiltprint: from a part to layers of paths in its own frame. Public: slice.slice_parts, slice.slice_part; values: paths."""
