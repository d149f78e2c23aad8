"""Worker: a process that does one task after another, as its parent asks over a pipe; it ends with its parent.

A task cannot be interrupted in compiled code, so it is stopped by ending the process with all that it has started.
"""

import os
import pickle
import signal
import struct
import sys
from asyncio import StreamReader
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO

LENGTH = struct.Struct("<Q")
TELLS, DONE, REFUSED = "tells", "done", "refused"


def frame(value: Any) -> bytes:
    """A value as it goes through the pipe."""
    content = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    return LENGTH.pack(len(content)) + content


def read_frames(pipe: BinaryIO) -> Iterator[Any]:
    """The values that come through a pipe, until it ends; a frame that is cut off is its end, too. Raises what pickle raises for
    a frame that is whole but cannot be read."""
    while len(head := pipe.read(LENGTH.size)) == LENGTH.size:
        (length,) = LENGTH.unpack(head)
        content = pipe.read(length)
        if len(content) < length:
            return
        yield pickle.loads(content)


async def read_frame(stream: StreamReader) -> Any:
    """The next value that comes through a pipe. Raises IncompleteReadError at its end."""
    (length,) = LENGTH.unpack(await stream.readexactly(LENGTH.size))
    return pickle.loads(await stream.readexactly(length))


def take_pipes() -> tuple[BinaryIO, BinaryIO]:
    """This process's pipes from and to its parent; what work prints does not reach them."""
    asked, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    with open(os.devnull, "r+b") as nowhere:
        os.dup2(nowhere.fileno(), 0)
        os.dup2(nowhere.fileno(), 1)
    return asked, answers


def main() -> None:
    """Do what is asked until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent speaks, and ends this process
    asked, answers = take_pipes()
    waiting: SimpleQueue[Any] = SimpleQueue()
    Thread(target=listen, args=(asked, waiting.put, _end_group), daemon=True).start()
    from machine.app.workbench.work.tasks import TASKS

    while True:
        name, given = waiting.get()
        _answer(answers, _result(TASKS[name], given, answers))


def _result(task: Any, given: tuple[Any, ...], answers: BinaryIO) -> tuple[str, Any]:
    from machine.app.crash import bug_in_words
    from profiles.errors import UserError

    try:
        return DONE, task(lambda value: _answer(answers, (TELLS, value)), *given)
    except UserError as error:
        return REFUSED, str(error)
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence and a log file, and the workbench goes on
        return REFUSED, bug_in_words(error, sys.argv)


def _answer(answers: BinaryIO, value: Any) -> None:
    answers.write(frame(value))
    answers.flush()


def listen(pipe: BinaryIO, take: Callable[[Any], None], end: Callable[[], None]) -> None:
    """Hand each value that comes through a pipe to take(); call end() when no more can come, however the other side has ended.

    Nobody can speak to this process any more then, so end() is called after a frame that cannot be read, too.
    """
    try:
        for value in read_frames(pipe):
            take(value)
    except OSError:
        pass
    finally:
        end()


def _end_group() -> None:
    """End this process and all that it has started."""
    if hasattr(os, "killpg"):
        os.killpg(0, signal.SIGKILL)  # it leads a group of its own
    os._exit(1)


if __name__ == "__main__":
    main()
