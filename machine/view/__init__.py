"""View: one HTML file that shows a print; docs/page-format.md has the format.

`page.print_page` and `page.parts_page` make it, `contents` the packed block in it, of columns (`encoding`) and a report.
"""
