"""tiltprint: from a part to layers of paths in the part frame. Public: slice.slice_parts, slice.slice_part; values: paths, heights."""
