"""Printing: one print, at a port or on a print server, whoever attends it.

`destination.parse_destination` reads where it goes, a `job.PrintJob` says what is to be done there, `printers.check_print` asks
what is asked before anything moves, and a `printers.Printer` (`serial_print`, `server_print`) prints it for a `job.Person`.
`resumption` goes on with what was cut off, `rescue` makes a printer safe whose sender has died.
"""
