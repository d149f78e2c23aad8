"""Opening the workbench to the network: addresses, ports, certificates."""

import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.workbench.access import network as lan
from machine.workbench.access.network import Certificate, Lan, listen, listen_at_all, network_addresses, open_lan
from profiles.errors import OutputError

needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")


@pytest.fixture
def network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lan, "network_addresses", lambda: ("192.168.1.5",))


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with certificates a.pem and b.pem and their keys: a.key, b.key, and locked.key, which is a.key with a password."""
    folder = tmp_path_factory.mktemp("certificates")

    def openssl(*arguments: str) -> None:
        subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True)

    for name in "ab":
        key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", f"{name}.key")
        openssl("req", "-x509", *key, "-out", f"{name}.pem", "-days", "2", "-subj", "/CN=workshop.local")
    openssl("pkcs8", "-topk8", "-in", "a.key", "-out", "locked.key", "-passout", "pass:secret")
    (folder / "none.pem").write_text("no certificate\n")
    return folder


def test_the_addresses_are_those_of_private_networks() -> None:
    for address in network_addresses():
        assert not address.startswith(("127.", "0."))
        listen(0, address).close()


@pytest.mark.parametrize(
    ("address", "private"),
    [
        ("192.168.1.5", True),
        ("10.1.2.3", True),
        ("169.254.7.8", True),
        ("100.64.0.1", True),
        ("8.8.8.8", False),
        ("127.0.1.1", False),
    ],
)
def test_no_address_reachable_from_the_internet_is_used(monkeypatch: pytest.MonkeyPatch, address: str, private: bool) -> None:
    monkeypatch.setattr(socket, "gethostbyname_ex", lambda name: (name, [], [address]))
    assert (address in network_addresses()) == private


def test_without_a_network_address_the_workbench_is_not_opened_to_the_network(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lan, "network_addresses", lambda: ())
    assert main(["edit", "--lan", "--no-browser"]) == 1
    assert "--lan: this computer has no address in a private network: join one, or leave --lan out" in capsys.readouterr().err


def test_the_host_names_that_a_browser_may_use() -> None:
    assert Lan(("10.0.0.2",), ("pi", "pi.local")).hosts(8123) == ("10.0.0.2:8123", "pi:8123", "pi.local:8123")
    assert Lan(("10.0.0.2",)).hosts(80) == ("10.0.0.2:80", "10.0.0.2")
    assert Lan(("10.0.0.2",), (), Certificate(Path("a"), Path("b"))).urls(8123) == ("https://10.0.0.2:8123/",)


def test_a_port_is_opened_at_all_addresses_or_at_none() -> None:
    own, others = listen_at_all(0, ("127.0.0.2", "127.0.0.3"))
    port = own.getsockname()[1]
    with own, others[0], others[1]:
        assert [each.getsockname() for each in others] == [("127.0.0.2", port), ("127.0.0.3", port)]
    with (
        listen(port, "127.0.0.3"),
        pytest.raises(OutputError, match=rf"--port {port} cannot be used at 127.0.0.3: "),
    ):
        listen_at_all(port, ("127.0.0.2", "127.0.0.3"))
    listen(port).close()
    with pytest.raises(OutputError, match=r"--lan: no port is free at all of 127.0.0.1, 192.0.2.77"):
        listen_at_all(0, ("192.0.2.77",))  # an address of another computer


@needs_openssl
def test_a_certificate_and_its_key_are_taken(certificates: Path, network: None) -> None:
    opened = open_lan(certificates / "a.pem", certificates / "a.key")
    assert (opened.scheme, opened.addresses) == ("https", ("192.168.1.5",))


@needs_openssl
@pytest.mark.parametrize(
    ("chain", "key", "sentence"),
    [
        ("a.pem", None, "--certificate needs --key, too: a certificate and its key, each a PEM file"),
        (None, "a.key", "--key needs --certificate, too: a certificate and its key, each a PEM file"),
        ("gone.pem", "a.key", "--certificate gone.pem cannot be read: no such file or directory"),
        ("a.pem", ".", "--key . cannot be read: is a directory"),
        ("a.pem", "b.key", "--key b.key does not belong to --certificate a.pem"),
        ("a.pem", "locked.key", "--key locked.key is encrypted by a password: one without is needed"),
        ("none.pem", "a.key", "--certificate none.pem and --key a.key cannot be used: both must be PEM files"),
        ("a.key", "a.pem", "--certificate a.key and --key a.pem cannot be used: both must be PEM files"),
    ],
)
def test_files_that_are_not_certificates_are_refused_in_one_sentence(
    chain: str | None,
    key: str | None,
    sentence: str,
    certificates: Path,
    network: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(certificates)
    options = [*(("--certificate", chain) if chain else ()), *(("--key", key) if key else ())]
    assert main(["edit", "--lan", "--no-browser", *options]) == 1
    told = capsys.readouterr()
    assert sentence in told.err
    assert "Traceback" not in told.err
    assert told.out == ""


def test_a_certificate_without_a_network_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["edit", "--certificate", "a.pem", "--key", "a.key"]) == 1
    assert "--certificate and --key need --lan: add it" in capsys.readouterr().err
