"""The bench as a value: what lies on the workbench, and what a page may change of it."""
