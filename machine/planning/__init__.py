"""Planning: sliced parts become strokes, travels and turns of the table, each inside the limits, each with its time."""
