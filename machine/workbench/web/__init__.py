"""Web: the server, its routes and websockets, and the page. Public: `serve.serve_workbench`."""
