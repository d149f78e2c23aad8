"""Devices: paired ones, each known by the digest of its cookie, and what they are called."""

import asyncio
from dataclasses import dataclass, field
from hashlib import sha256

# What a user agent has -> the word for it; the first that fits, for Android names Linux, too, and most browsers Safari.
SYSTEMS = (
    *(("iPhone", "iPhone"), ("iPad", "iPad"), ("Android", "Android"), ("Windows", "Windows"), ("CrOS", "Chromebook")),
    *(("Mac OS X", "Mac"), ("Linux", "Linux")),
)
BROWSERS = (
    *(("Edg", "Edge"), ("OPR/", "Opera"), ("SamsungBrowser", "Samsung Internet"), ("Firefox", "Firefox"), ("FxiOS", "Firefox")),
    *(("Chrom", "Chrome"), ("CriOS", "Chrome"), ("Safari", "Safari")),
)


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
