"""Demo models that ship with the program, made by tools/docs/make_demos.py: `demo:NAME` reads NAME.ply of this folder."""
