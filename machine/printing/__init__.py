"""Printing: one print on a printer at a port or on a print server, from a terminal or a page.

`destination.parse_destination` parses where it goes, a `job.PrintJob` says what is done there, `printers.check_print` makes all
checks before anything moves, and a `printers.Printer` (`serial_print`, `server_print`) prints it for a `job.Person`. `resumption`
continues interrupted prints; `rescue` makes a printer safe after its sender has died.
"""
