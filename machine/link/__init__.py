"""The host's side of the line: streaming, pausing, the journal, resuming."""
