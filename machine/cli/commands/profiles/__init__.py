"""The profiles commands: list, show, save and check them; import those of other slicers; detect a machine by its firmware."""
