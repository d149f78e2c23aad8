"""Door: pairing and the paired devices of one run, and what the terminal and the page of this computer are told of them."""

import secrets
from collections.abc import Callable
from time import monotonic, time
from typing import Any

from machine.workbench.access.devices import Device, device_name, digest_of
from machine.workbench.access.pairing import Pairing, Verdict, fresh_code, grouped, judge
from machine.workbench.work.observable import Observable
from profiles.errors import PlanError

COOKIE_BYTES = 24


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
            self._say("whoever is in this network can read along: use --lan in a network of your own only, or with --certificate")

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

    def unpair(self, number: object) -> None:
        """Let a device go: its lines end now. Raises PlanError where it is not there."""
        device = next((device for device in self.devices if device.number == number), None)
        if device is None:
            raise PlanError("this device is not paired any more")
        self.devices.remove(device)
        device.gone.set()
        self._say(f"{device.name} is not paired any more")
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
