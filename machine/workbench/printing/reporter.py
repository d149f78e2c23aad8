"""Reporter: tells the server the newest state of a print, from a thread of its own: who prints never waits for who listens."""

from threading import Event, Lock, Thread
from typing import Any, BinaryIO

from machine.workbench.printing.order import State
from mdp.kernels.workers import frame

LAST_WORD_S = 5.0  # a server that stands still is not waited for any longer


class StateReporter:
    """tell() from any thread; what comes while the server does not read is put together, so nothing is ever held back."""

    def __init__(self, out: BinaryIO, state: State) -> None:
        self._out, self._state = out, state
        self._lock, self._changed, self._over = Lock(), Event(), False
        self._thread = Thread(target=self._serve, name="reporter", daemon=True)
        self._thread.start()

    def tell(self, **values: Any) -> None:
        """Change parts of the state."""
        with self._lock:
            self._state = {**self._state, **values}
        self._changed.set()

    def close(self) -> None:
        """Say the last word."""
        self._over = True
        self._changed.set()
        self._thread.join(LAST_WORD_S)

    def _serve(self) -> None:
        over = False
        while not over:
            self._changed.wait()
            self._changed.clear()
            over = self._over
            try:
                self._out.write(frame(self._state))
                self._out.flush()
            except (OSError, ValueError):  # the server is gone: the print ends by what it hears, not by what it says
                return
