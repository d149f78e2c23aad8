"""Runs the workbench from its address to Ctrl-C, after which nothing of it remains running."""

import asyncio
import gc
import secrets
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from threading import Thread

import uvicorn
from starlette.types import ASGIApp

from machine.cli.terminal.interrupts import calling
from machine.notices import say
from machine.pipeline.requests import UPLOAD_MIB
from machine.view.serving.guard import HOST
from machine.workbench.access.network import Lan, listen_at_all
from machine.workbench.access.pairing import Door
from machine.workbench.printing.prints import Prints
from machine.workbench.session.base import in_loop
from machine.workbench.session.session import Session, Workbench
from machine.workbench.web.server import Served, application, lan_application
from machine.workbench.web.uploads import Uploads
from machine.workbench.work.folders import files_in, tidy_left
from machine.workbench.work.worker_pool import WorkerPools

GRACE_S = 1  # for pending answers and for its processes at the end
KEEP_S = 20.0  # for saving all benches, which takes less than a second except for huge models or slow disks
SWITCH_S = 0.0005  # between threads; the default is 5 ms, and a stop waits several times
MOST_SENT = 1 << 20  # bytes of a page's message; files are uploaded otherwise


class Server(uvicorn.Server):
    """Uvicorn's server, without its signal handlers."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Install no handlers: Ctrl-C calls `stop`."""
        yield

    def stop(self) -> None:
        """Stop soon; at once if called again."""
        self.force_exit = self.should_exit
        self.should_exit = True


def serve_workbench(
    make: Callable[[WorkerPools], Session],
    begin: Callable[[Session], None],
    announce: Callable[..., None],
    port: int = 0,
    upload_mib: int = UPLOAD_MIB,
    lan: Lan | None = None,
) -> None:
    """Serve until Ctrl-C. make: creates a session; begin: receives the first one; both run in the sessions' event loop; announce:
    receives the address when the server answers, and those in the network; upload_mib: size limit of uploads; lan: network to
    open the workbench to, or None."""
    with ExitStack() as stack:
        own, of_lan = listen_at_all(port, lan.addresses if lan else ())
        for each in (own, *of_lan):
            stack.enter_context(each)
        folders = tidy_left()
        if folders:
            names = f"{folders[0]} and {len(folders) - 1} more" if folders[1:] else str(folders[0])
            left = f"workbenches that were killed have left the files of their benches in {names}"
            say(f"{left}: the page offers them, and they go with a start in a day")
        benches = stack.enter_context(event_loop("benches"))
        asyncio.run(_serve(benches, make, begin, announce, own, Uploads(upload_mib, files_in(*folders)), lan, of_lan))


@contextmanager
def event_loop(name: str) -> Iterator[asyncio.AbstractEventLoop]:
    """Run an event loop in its own thread, for `in_loop`. What hangs there at the end is not waited for."""
    loop, ended = asyncio.new_event_loop(), asyncio.Event()

    def run() -> None:
        with asyncio.Runner(loop_factory=lambda: loop) as runner:  # cancels remaining tasks
            runner.run(ended.wait())

    thread = Thread(target=run, name=name, daemon=True)
    thread.start()
    try:
        yield loop
    finally:
        loop.call_soon_threadsafe(ended.set)
        thread.join(GRACE_S)


async def _serve(
    benches: asyncio.AbstractEventLoop,
    make: Callable[[WorkerPools], Session],
    begin: Callable[[Session], None],
    announce: Callable[..., None],
    own: socket.socket,
    uploads: Uploads,
    lan: Lan | None,
    of_lan: Sequence[socket.socket],
) -> None:
    number, token = own.getsockname()[1], secrets.token_urlsafe(24)
    workbench, prints, loop = Workbench(make), Prints(), asyncio.get_running_loop()
    served = Served(workbench, benches, prints, uploads)
    door = Door(say, lan.urls(number), lan.certificate is not None) if lan else None

    async def open_first() -> int:
        first = workbench.open()
        begin(workbench.sessions[first])
        return first

    servers = [(_server(application(served, token, number, door)), [own])]
    if lan and door:
        servers.append((_server(lan_application(served, door, lan, number), lan), list(of_lan)))
    ending = list[asyncio.Task[None]]()

    def stop() -> None:
        for server, _ in servers:
            server.stop()

    def end() -> None:
        """End the prints first, heaters off; if called again, stop the workbench at once, and the prints end by themselves."""
        if ending or not prints.running:
            stop()
        else:
            ending.append(loop.create_task(_end_prints(prints, stop)))

    def interrupt() -> None:
        loop.call_soon_threadsafe(end)

    try:
        first = await in_loop(benches, open_first())
        keep_stops_quick()
        with calling(interrupt):
            answering = asyncio.gather(*(server.serve(sockets=those) for server, those in servers))
            while not all(server.started for server, _ in servers) and not answering.done():
                await asyncio.sleep(0.01)
            announce(f"http://{HOST}:{number}/{token}/{first}/", *(lan.urls(number) if lan else ()))
            if door:
                door.announce()
            await answering
    finally:
        prints.close()
        with suppress(TimeoutError):  # whatever hangs there ends with the program, and no file that is still read is deleted
            async with asyncio.timeout(KEEP_S):
                for trouble in await in_loop(benches, workbench.close_all()):
                    say(trouble)


def _server(app: ASGIApp, lan: Lan | None = None) -> Server:
    """lan: the network to serve, None: this computer alone."""
    certificate = lan.certificate if lan else None
    settings = uvicorn.Config(
        app,
        log_config=None,
        lifespan="off",
        ws="websockets-sansio",
        ws_max_size=MOST_SENT,
        ws_per_message_deflate=False,  # not worth it within this computer or its network
        timeout_graceful_shutdown=GRACE_S,
        server_header=False,
        proxy_headers=False,
        ssl_certfile=certificate.chain if certificate else None,
        ssl_keyfile=certificate.key if certificate else None,
    )
    return Server(settings)


def keep_stops_quick() -> None:
    """Keep the prints' thread responsive: exclude loaded objects from garbage collection, which can take a tenth of a second, and
    switch threads more often than by default."""
    gc.freeze()
    sys.setswitchinterval(SWITCH_S)


async def _end_prints(prints: Prints, then: Callable[[], None]) -> None:
    there, here = ([job.state.port for job in prints.running if job.state.server is server] for server in (True, False))
    if there:
        say(f"the print on {' and '.join(there)} continues there, an upload is cancelled")
    if here:
        ports = " and ".join(here)
        say(f"the print at {ports} is stopped and its heaters go off, wait for that; Ctrl-C again does not wait for it")
    try:
        for line in await prints.end_all():
            say(line)
    finally:
        then()
