"""The profiles commands: list, show, save, check, import from other slicers, and detect a machine by its firmware."""
