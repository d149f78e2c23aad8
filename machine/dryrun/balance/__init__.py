"""Balance: the plastic that a print lays down against the room that there is for it, column by column.

It reads G-code alone and shares no code with what gave each bead its volume. `columns` has the lattice, `interfaces` asks
where a part stands on others, where the room ends at what these have left there; tools/checks/plastic.py prints what it tells.
"""
