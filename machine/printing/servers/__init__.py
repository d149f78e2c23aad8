"""Print servers (OctoPrint, Moonraker, Duet): upload, start, follow and stop prints over HTTP.

`servers.open_server` opens a session with a `server.PrintServer`; `follow.Follower` starts a file and follows it to its end.
"""
