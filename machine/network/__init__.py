"""Network: print servers (OctoPrint, Moonraker, Duet): files handed over, printed from there, followed and stopped over HTTP."""
