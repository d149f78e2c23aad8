"""Demo models that ship with the program, made by tools/make_demos.py: `demo:NAME` reads NAME.ply of this folder."""
