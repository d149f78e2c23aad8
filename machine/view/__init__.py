"""View: one HTML file that shows a print; docs/page-format.md has the format.

`page.print_page` and `page.parts_page` write it, `contents` its packed block of columns (`encoding`) with a report.
"""
