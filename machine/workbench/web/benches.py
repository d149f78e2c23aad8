"""Benches: a further one with a page of its own, and closing one, which ends its work."""

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Route

from machine.notices import say
from machine.workbench.bench.page_words import page_words
from machine.workbench.bench.values import is_small_number
from machine.workbench.session.workbench import Workbench
from profiles.errors import PlanError


def bench_routes(workbench: Workbench) -> list[Route]:
    """What is not of one bench: `benches` (POST: one more, with the settings of that `like`), `benches/N` (DELETE),
    and the address without a number, which leads to the first."""

    async def first(request: Request) -> Response:
        number = min(workbench.sessions, default=0) or workbench.open()
        return RedirectResponse(f"{number}/")

    async def opened(request: Request) -> Response:
        like = request.query_params.get("like", "")
        try:
            number = workbench.open(workbench.sessions.get(int(like)) if is_small_number(like) else None)
        except PlanError as error:
            return JSONResponse({"problem": page_words(str(error))}, status_code=422)
        return JSONResponse({"number": number})

    async def closed(request: Request) -> Response:
        trouble = await workbench.close(request.path_params["number"])
        if trouble:  # its page is gone
            say(trouble)
        return JSONResponse({})

    return [
        Route("/{token}/", first),
        Route("/{token}/benches", opened, methods=["POST"]),
        Route("/{token}/benches/{number:int}", closed, methods=["DELETE"]),
    ]
