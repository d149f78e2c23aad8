"""Servers: print servers (OctoPrint, Moonraker, Duet): files are handed over, printed from there, followed and stopped over HTTP.

`servers.open_server` is a session with a `server.PrintServer`, `follow.Follower` has a file printed and follows it to its
end.
"""
