"""Printer: one at a port: whether it fits machine and program, the stream to it, what is recorded of it."""
