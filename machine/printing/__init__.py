"""Printer: one at a port: whether it fits machine and program, the stream to it, what is recorded of it.

`stream.print_program` prints at a port, `network_print.print_there` on a server, `resumption` goes on with what was cut off;
before anything moves `compatibility` and `server_checks` hold printer, machine and program together.
"""
