"""Pairing: checks the code typed on a device, gives the device a cookie, and keeps the list of paired devices.

Wrong codes are counted over all devices, because addresses can be forged and shared. At most 20 of 31 ** 8 codes are ever tried.
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
FIRST_WAIT_S = 30.0  # after too many wrong codes; doubled each time
# Text in a user agent -> name. The first match wins: Android also names Linux, and most browsers name Safari.
SYSTEMS = (
    *(("iPhone", "iPhone"), ("iPad", "iPad"), ("Android", "Android"), ("Windows", "Windows"), ("CrOS", "Chromebook")),
    *(("Mac OS X", "Mac"), ("Linux", "Linux")),
)
BROWSERS = (
    *(("Edg", "Edge"), ("OPR/", "Opera"), ("SamsungBrowser", "Samsung Internet"), ("Firefox", "Firefox"), ("FxiOS", "Firefox")),
    *(("Chrom", "Chrome"), ("CriOS", "Chrome"), ("Safari", "Safari")),
)
COOKIE_BYTES = 24
# Contains all that a device may see; pairing_page() removes what does not apply.
PAGE = (Path(__file__).parent / "pairing.html").read_text("utf-8").replace("{length}", str(CODE_LENGTH))
STYLE = PAGE.partition("<style>")[2].partition("</style>")[0]
REFUSAL, FORM = re.compile(r'<p class="error".*?</p>\n', re.DOTALL), re.compile(r"<form.*?</form>\n", re.DOTALL)
AFTER_ERROR = 'refusal hint" aria-invalid="true"'  # attribute of the field while it has an error
OPEN_NETWORK = re.compile(r'<p class="soft" id="open-network">.*?</p>\n', re.DOTALL)


class Verdict(StrEnum):
    """Result of a typed code. spent: wrong, and the code has been replaced; waits, closed: it was not compared."""

    PAIRED = "paired"
    WRONG = "wrong"
    SPENT = "spent"
    WAITS = "waits"
    CLOSED = "closed"


@dataclass(frozen=True)
class Pairing:
    """State of pairing. code: the valid code; wrong: wrong codes typed since it became valid; wrong_in_all: since pairing was
    opened; waits: number of codes used up; waits_until_s: time until which codes are refused."""

    code: str = field(repr=False)
    wrong: int = 0
    wrong_in_all: int = 0
    waits: int = 0
    waits_until_s: float = 0.0

    @property
    def closed(self) -> bool:
        """Whether no more devices are paired."""
        return self.wrong_in_all >= WRONG_IN_ALL


def fresh_code() -> str:
    return "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))


def grouped(code: str) -> str:
    """Format a code for reading, such as ABCD-EFGH."""
    return f"{code[: CODE_LENGTH // 2]}-{code[CODE_LENGTH // 2 :]}"


def judge(pairing: Pairing, typed: str, now_s: float, fresh: str) -> tuple[Pairing, Verdict]:
    """Check a code typed at a time; returns the new state and the result. fresh: replaces a code that is used or spent."""
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
    """The typed code in upper case, without separators."""
    return "".join(letter for letter in typed.upper() if letter.isalnum()).encode()


@dataclass(frozen=True)
class Device:
    """number: from 1, never reused; paired_s: since the epoch; digest: of its cookie; gone: set when it is unpaired."""

    number: int
    name: str
    paired_s: float
    digest: bytes = field(repr=False)
    gone: asyncio.Event = field(default_factory=asyncio.Event, repr=False)


def device_name(user_agent: str) -> str:
    """Name such as 'iPhone, Safari', made of our own words only, because anyone can send any text."""
    found = [next((word for sign, word in table if sign in user_agent), "") for table in (SYSTEMS, BROWSERS)]
    return ", ".join(filter(None, found)) or "a device"


def digest_of(cookie: str) -> bytes:
    """Hash of a cookie, which is stored in its place."""
    return sha256(cookie.encode()).digest()


class Door(Observable):
    """Pairs devices; used from the server's event loop. say: prints to the terminal, which alone shows the code; addresses: for
    devices to open; encrypted: by https; clock: seconds, as `time.monotonic`."""

    def __init__(
        self, say: Callable[[str], None], addresses: tuple[str, ...], encrypted: bool, clock: Callable[[], float] = monotonic
    ) -> None:
        super().__init__()
        self.pairing, self.devices = Pairing(fresh_code()), list[Device]()
        self.encrypted = encrypted
        self._say, self._addresses, self._clock = say, addresses, clock
        self._last = 0  # last number given

    @property
    def wait_s(self) -> float:
        """Time until which codes are refused, from now."""
        return max(0.0, self.pairing.waits_until_s - self._clock())

    def announce(self) -> None:
        """Explain how to pair a device."""
        self._say(f"open to the network, too: a device that opens {' or '.join(self._addresses)} asks for a code: {self._code}")
        if not self.encrypted:
            self._say(
                f"others in this network can read along: use {option('lan')} only in your own network, or with "
                f"{option('certificate')}"
            )

    def attempt(self, typed: str, user_agent: str) -> tuple[Verdict, str]:
        """Check a code typed on a device; returns the result, and the cookie if it is now paired, else ""."""
        self.pairing, verdict = judge(before := self.pairing, typed, self._clock(), fresh_code())
        if verdict == Verdict.PAIRED:
            return verdict, self._admit(device_name(user_agent))
        if verdict == Verdict.SPENT:
            self._say(
                f"{before.wrong + 1} wrong codes were typed: for {self.wait_s:.0f} s none is taken, then a new one: {self._code}"
            )
        elif verdict == Verdict.CLOSED and not before.closed:
            wrong = f"{self.pairing.wrong_in_all} wrong codes were typed: no further device can be paired"
            self._say(f"{wrong} until the page on this computer lets them, or tiltprint edit is started again")
        if self.pairing != before:
            self.notify()
        return verdict, ""

    def device_of(self, cookie: str) -> Device | None:
        """The paired device with this cookie; compares all devices, so that the time reveals nothing."""
        digest = digest_of(cookie)
        same = [device for device in self.devices if secrets.compare_digest(device.digest, digest)]
        return same[0] if same else None

    def unpair(self, *, device: int) -> None:
        """Unpair a device and close its connections. Raises PlanError if it is not paired."""
        paired = next((paired for paired in self.devices if paired.number == device), None)
        if paired is None:
            raise PlanError("this device is no longer paired")
        self.devices.remove(paired)
        paired.gone.set()
        self._say(f"{paired.name} is no longer paired")
        self.notify()

    def reopen(self) -> None:
        """Reset the count of wrong codes, and replace the code."""
        self.pairing = Pairing(fresh_code())
        self._say(f"devices can pair again; the code: {self._code}")
        self.notify()

    def snapshot(self) -> dict[str, Any]:
        """State for the page of this computer; never contains the code."""
        return {
            "version": self.version,
            "addresses": self._addresses,
            "qr_code": segno.make(self._addresses[0], micro=False).svg_data_uri(border=1),  # without the code
            "encrypted": self.encrypted,
            "closed": self.pairing.closed,
            "waits_until_s": time() + self.wait_s if self.wait_s else 0.0,  # since the epoch, because a page may receive it late
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
    """The pairing page. verdict: on the code that this device sent, None: it sent none."""
    refusal, wait_s = _refusal(door, verdict), door.wait_s
    body = FORM.sub("", PAGE) if door.pairing.closed else PAGE
    body = OPEN_NETWORK.sub("", body) if door.encrypted else body
    body = body.replace("{refusal}", escape(refusal)) if refusal else REFUSAL.sub("", body).replace(AFTER_ERROR, 'hint"')
    rest = "img-src data:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    headers = {
        "content-security-policy": f"default-src 'none'; style-src {hash_source(STYLE)}; {rest}",
        "referrer-policy": "same-origin",  # otherwise the form would be sent without its origin
        **({"retry-after": f"{wait_s:.0f}"} if wait_s else {}),
    }
    return HTMLResponse(body, 200 if verdict is None else STATUS[verdict], headers)


def _refusal(door: Door, verdict: Verdict | None) -> str:
    """Sentence on why this device cannot be paired, or ""."""
    if door.pairing.closed:
        return "Too many wrong codes were typed: no further device can be paired. The page on the computer can allow it again."
    if door.wait_s:
        return f"Too many wrong codes were typed. Wait {door.wait_s:.0f} seconds; the terminal shows a new code."
    return "This is not the code that the terminal shows now." if verdict == Verdict.WRONG else ""
