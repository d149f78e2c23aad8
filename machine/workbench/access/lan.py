"""Lan: how the workbench is reached from the local network: by which addresses, encrypted or not."""

import ssl
from dataclasses import dataclass
from pathlib import Path

from machine.view.serving.guard import own_hosts
from machine.workbench.access.addresses import host_names, network_addresses
from profiles.errors import OutputError, reason


@dataclass(frozen=True)
class Certificate:
    """Files in PEM."""

    chain: Path
    key: Path


@dataclass(frozen=True)
class Lan:
    """addresses: of this computer; names: by which it may be known, too; certificate: None: not encrypted."""

    addresses: tuple[str, ...]
    names: tuple[str, ...] = ()
    certificate: Certificate | None = None

    @property
    def scheme(self) -> str:
        """The scheme of its addresses: http or https."""
        return "http" if self.certificate is None else "https"

    def hosts(self, port: int) -> tuple[str, ...]:
        """What a browser may call the server at a port."""
        return own_hosts((*self.addresses, *self.names), port, self.scheme)

    def urls(self, port: int) -> tuple[str, ...]:
        """What a person types."""
        return tuple(f"{self.scheme}://{address}:{port}/" for address in self.addresses)


def open_lan(chain: Path | None, key: Path | None) -> Lan:
    """The network that is there now. Raises OutputError where there is none, and for a certificate that cannot be used."""
    certificate = None if chain is None and key is None else _checked(chain, key)
    addresses = network_addresses()
    if not addresses:
        raise OutputError("--lan: this computer has no address in a private network: join one, or leave --lan out")
    return Lan(addresses, host_names(), certificate)


def _checked(chain: Path | None, key: Path | None) -> Certificate:
    if chain is None or key is None:
        given, other = ("--key", "--certificate") if chain is None else ("--certificate", "--key")
        raise OutputError(f"{given} needs {other}, too: a certificate and its key, each a PEM file")
    for option, file in (("--certificate", chain), ("--key", key)):
        try:
            file.read_bytes()
        except OSError as error:
            raise OutputError(f"{option} {file} cannot be read: {reason(error)}") from None
    _check_pair(chain, key)
    return Certificate(chain, key)


def _check_pair(chain: Path, key: Path) -> None:
    """Raises OutputError for what is no certificate, no key, or not the certificate's."""
    asked = []

    def password() -> str:
        asked.append(True)
        return ""

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(chain, key, password)
    except (ssl.SSLError, ValueError) as error:
        if asked:
            raise OutputError(f"--key {key} is encrypted by a password: one without is needed") from None
        if getattr(error, "reason", "") == "KEY_VALUES_MISMATCH":
            raise OutputError(f"--key {key} does not belong to --certificate {chain}") from None
        raise OutputError(
            f"--certificate {chain} and --key {key} cannot be used: both must be PEM files, of an X.509 certificate and its key"
        ) from None
