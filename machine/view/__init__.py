"""View: one HTML file that shows a print; CONTRIBUTING.md has the format of its data.

`page.print_page` and `page.parts_page` write it, `contents` its packed block of columns (`encoding`) with a report.
"""
