"""Pairing: a code that is typed on a device is judged, the device gets a cookie, and the door keeps the devices of one run.

Wrong codes are counted over all devices: an address can be forged, and shared. At most 20 of 31 ** 8 codes are ever tried.
"""

import asyncio
import re
import secrets
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from hashlib import sha256
from html import escape
from pathlib import Path
from time import monotonic, time
from typing import Any

import segno
from starlette.responses import HTMLResponse

from machine.view.page import hash_source
from machine.workbench.session.base import Observable
from profiles.errors import PlanError
from profiles.messages import option

LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"  # without I, L, O, 0 and 1, which look alike
CODE_LENGTH = 8
WRONG_OF_A_CODE, WRONG_IN_ALL = 5, 20
FIRST_WAIT_S = 30.0  # after the first code that was used up by wrong ones; doubled after every further one
# What a user agent has -> the word for it; the first that fits, for Android names Linux, too, and most browsers Safari.
SYSTEMS = (
    *(("iPhone", "iPhone"), ("iPad", "iPad"), ("Android", "Android"), ("Windows", "Windows"), ("CrOS", "Chromebook")),
    *(("Mac OS X", "Mac"), ("Linux", "Linux")),
)
BROWSERS = (
    *(("Edg", "Edge"), ("OPR/", "Opera"), ("SamsungBrowser", "Samsung Internet"), ("Firefox", "Firefox"), ("FxiOS", "Firefox")),
    *(("Chrom", "Chrome"), ("CriOS", "Chrome"), ("Safari", "Safari")),
)
COOKIE_BYTES = 24
# With all that a device may see; pairing_page() leaves out what does not concern it.
PAGE = (Path(__file__).parent / "pairing.html").read_text("utf-8").replace("{length}", str(CODE_LENGTH))
STYLE = PAGE.partition("<style>")[2].partition("</style>")[0]
TOLD, FORM = re.compile(r'<p class="error".*?</p>\n', re.DOTALL), re.compile(r"<form.*?</form>\n", re.DOTALL)
AFTER_ERROR = 'told hint" aria-invalid="true"'  # of the field, as it is described
OPEN_NETWORK = re.compile(r'<p class="soft" id="open-network">.*?</p>\n', re.DOTALL)


class Verdict(StrEnum):
    """What becomes of a code that was typed. spent: wrong, and the code is another one now; waits, closed: not compared."""

    PAIRED = "paired"
    WRONG = "wrong"
    SPENT = "spent"
    WAITS = "waits"
    CLOSED = "closed"


@dataclass(frozen=True)
class Pairing:
    """code: the one that pairs next; wrong, wrong_in_all: how many others were typed since it is the code, and since pairing is
    open; waits: how often codes were used up; waits_until_s: codes are refused until then."""

    code: str = field(repr=False)
    wrong: int = 0
    wrong_in_all: int = 0
    waits: int = 0
    waits_until_s: float = 0.0

    @property
    def closed(self) -> bool:
        """Whether no device is paired any more."""
        return self.wrong_in_all >= WRONG_IN_ALL


def fresh_code() -> str:
    """A random code."""
    return "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))


def grouped(code: str) -> str:
    """A code as it is read: ABCD-EFGH."""
    return f"{code[: CODE_LENGTH // 2]}-{code[CODE_LENGTH // 2 :]}"


def judge(pairing: Pairing, typed: str, now_s: float, fresh: str) -> tuple[Pairing, Verdict]:
    """The state after a code was typed at a time, and what becomes of it. fresh: the code that follows one that is used up."""
    if pairing.closed:
        return pairing, Verdict.CLOSED
    if now_s < pairing.waits_until_s:
        return pairing, Verdict.WAITS
    if secrets.compare_digest(_plain(typed), pairing.code.encode()):
        return replace(pairing, code=fresh, wrong=0), Verdict.PAIRED
    after = replace(pairing, wrong=pairing.wrong + 1, wrong_in_all=pairing.wrong_in_all + 1)
    if after.closed:
        return replace(after, code=fresh), Verdict.CLOSED
    if after.wrong < WRONG_OF_A_CODE:
        return after, Verdict.WRONG
    wait_s = FIRST_WAIT_S * 2**after.waits
    return replace(after, code=fresh, wrong=0, waits=after.waits + 1, waits_until_s=now_s + wait_s), Verdict.SPENT


def _plain(typed: str) -> bytes:
    """What a person has typed, without the strokes and spaces between and in capitals."""
    return "".join(letter for letter in typed.upper() if letter.isalnum()).encode()


@dataclass(frozen=True)
class Device:
    """number: from 1 on, not given again; paired_s: since the epoch; digest: of its cookie; gone: set when it is let go."""

    number: int
    name: str
    paired_s: float
    digest: bytes = field(repr=False)
    gone: asyncio.Event = field(default_factory=asyncio.Event, repr=False)


def device_name(user_agent: str) -> str:
    """In words of our own alone, for everybody can send any text: 'iPhone, Safari'."""
    found = [next((word for sign, word in table if sign in user_agent), "") for table in (SYSTEMS, BROWSERS)]
    return ", ".join(filter(None, found)) or "a device"


def digest_of(cookie: str) -> bytes:
    """What is kept of a cookie."""
    return sha256(cookie.encode()).digest()


class Door(Observable):
    """All from the event loop of the server. say: tells the person at the terminal, who alone learns the code; addresses: those
    that a device is to open; encrypted: by https; clock: seconds, as `time.monotonic`."""

    def __init__(
        self, say: Callable[[str], None], addresses: tuple[str, ...], encrypted: bool, clock: Callable[[], float] = monotonic
    ) -> None:
        super().__init__()
        self.pairing, self.devices = Pairing(fresh_code()), list[Device]()
        self.encrypted = encrypted
        self._say, self._addresses, self._clock = say, addresses, clock
        self._last = 0  # number that was given

    @property
    def wait_s(self) -> float:
        """How long codes are still refused."""
        return max(0.0, self.pairing.waits_until_s - self._clock())

    def announce(self) -> None:
        """Say what to do."""
        self._say(f"open to the network, too: a device that opens {' or '.join(self._addresses)} asks for a code: {self._code}")
        if not self.encrypted:
            self._say(
                f"whoever is in this network can read along: use {option('lan')} in a network of your own only, or with "
                f"{option('certificate')}"
            )

    def attempt(self, typed: str, user_agent: str) -> tuple[Verdict, str]:
        """Judge a code that was typed on a device; its cookie where it is paired now, else ""."""
        self.pairing, verdict = judge(before := self.pairing, typed, self._clock(), fresh_code())
        if verdict == Verdict.PAIRED:
            return verdict, self._admit(device_name(user_agent))
        if verdict == Verdict.SPENT:
            self._say(
                f"{before.wrong + 1} wrong codes were typed: for {self.wait_s:.0f} s none is taken, then a new one: {self._code}"
            )
        elif verdict == Verdict.CLOSED and not before.closed:
            wrong = f"{self.pairing.wrong_in_all} wrong codes were typed: no device is paired any more"
            self._say(f"{wrong} until the page on this computer lets them, or tiltprint edit is started again")
        if self.pairing != before:
            self.notify()
        return verdict, ""

    def device_of(self, cookie: str) -> Device | None:
        """The paired device that has this cookie; all are compared, in the same time for every cookie."""
        digest = digest_of(cookie)
        same = [device for device in self.devices if secrets.compare_digest(device.digest, digest)]
        return same[0] if same else None

    def unpair(self, *, device: int) -> None:
        """Let a device go: its lines end now. Raises PlanError where it is not there."""
        paired = next((paired for paired in self.devices if paired.number == device), None)
        if paired is None:
            raise PlanError("this device is not paired any more")
        self.devices.remove(paired)
        paired.gone.set()
        self._say(f"{paired.name} is not paired any more")
        self.notify()

    def reopen(self) -> None:
        """Begin anew with the counting of wrong codes, and with another code."""
        self.pairing = Pairing(fresh_code())
        self._say(f"devices can pair again; the code: {self._code}")
        self.notify()

    def snapshot(self) -> dict[str, Any]:
        """What the page of this computer is told; never the code."""
        return {
            "version": self.version,
            "addresses": self._addresses,
            "qr_code": segno.make(self._addresses[0], micro=False).svg_data_uri(border=1),  # without the code
            "encrypted": self.encrypted,
            "closed": self.pairing.closed,
            "waits_until_s": time() + self.wait_s if self.wait_s else 0.0,  # since the epoch: a page may hear of it later
            "devices": [{"number": each.number, "name": each.name, "paired_s": each.paired_s} for each in self.devices],
        }

    @property
    def _code(self) -> str:
        return grouped(self.pairing.code)

    def _admit(self, name: str) -> str:
        cookie = secrets.token_urlsafe(COOKIE_BYTES)
        self._last += 1
        self.devices.append(Device(self._last, name, time(), digest_of(cookie)))
        self._say(f"{name} is paired; the code for the next device: {self._code}")
        self.notify()
        return cookie


STATUS = {Verdict.WRONG: 403, Verdict.SPENT: 403, Verdict.WAITS: 429, Verdict.CLOSED: 403}


def pairing_page(door: Door, verdict: Verdict | None = None) -> HTMLResponse:
    """The page. verdict: on the code that this device has typed, None where it has typed none."""
    told, wait_s = _told(door, verdict), door.wait_s
    body = FORM.sub("", PAGE) if door.pairing.closed else PAGE
    body = OPEN_NETWORK.sub("", body) if door.encrypted else body
    body = body.replace("{told}", escape(told)) if told else TOLD.sub("", body).replace(AFTER_ERROR, 'hint"')
    rest = "img-src data:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    headers = {
        "content-security-policy": f"default-src 'none'; style-src {hash_source(STYLE)}; {rest}",
        "referrer-policy": "same-origin",  # else the form would be sent without its origin
        **({"retry-after": f"{wait_s:.0f}"} if wait_s else {}),
    }
    return HTMLResponse(body, 200 if verdict is None else STATUS[verdict], headers)


def _told(door: Door, verdict: Verdict | None) -> str:
    """What keeps this device from being paired, "" where nothing does."""
    if door.pairing.closed:
        return "Too many wrong codes were typed: no device is paired any more. The page on the computer can let them again."
    if door.wait_s:
        return f"Too many wrong codes were typed. Wait {door.wait_s:.0f} seconds; the terminal shows a new code."
    return "This is not the code that the terminal shows now." if verdict == Verdict.WRONG else ""
