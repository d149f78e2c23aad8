"""Bench: what lies on the workbench and what a page may change of it, as values; nothing here writes or waits.

Public: `bench.Bench`, `bench.History`, the commands that change it in `changes`, `settings.settings_list`.
"""
