"""View: one HTML file that shows a print; docs/view.md has the format."""
