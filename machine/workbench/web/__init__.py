"""Web: the server, its addresses and lines, and the page. Public: `serve.serve_workbench`."""
