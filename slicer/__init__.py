"""From a part to layers of paths in the part frame. Public: parts.slice_parts, slice.slice_part; values: paths, heights."""
