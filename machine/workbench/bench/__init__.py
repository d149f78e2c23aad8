"""Bench: the model on the workbench and what a page may change of it, as values; no I/O, no waiting.

Public: `bench.Bench`, `bench.History`, the commands that change it in `changes`, `settings.settings_list`.
"""
