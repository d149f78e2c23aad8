"""Bench: what lies on the workbench and what a page may change of it, as values; nothing here writes or waits.

Public: `bench.Bench` and `bench.History`, the changes in `changes`, `planes`, `marks` and `stops`, `settings.settings_list`.
"""
