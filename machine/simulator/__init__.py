"""The simulated printer; a host sees it only through a terminal or a socket."""
