"""Ports: devices, socket:// and rfc2217:// behave alike, and every failure is reported in one sentence."""

import os
import pty
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import monotonic

import pytest

from machine.link import port as port_module
from machine.link.medium import SERIAL, Wire
from machine.link.port import Port, SerialDevice, find_again, find_device, open_port, serial_devices
from machine.link.protocol.timeout import Timing
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PortError
from profiles.profile import load
from tests.machine.link.test_stream import HEAT, assert_executed, strokes
from tests.machine.peers import PATIENCE_S, RATES, behind_rfc2217, on_socket, on_terminal
from tests.machine.virtual_printer import VirtualPrinter

MACHINE = load().machine
PATIENT = replace(
    SERIAL, timing=Timing(stall_s=PATIENCE_S, stall_mute_s=PATIENCE_S, sync_s=PATIENCE_S, drain_s=0.05, quiet_s=0.03)
)
PROGRAM = ["M83", *(f"G1 X{1 + i % 90}.{i:05d} Y{i % 70}.5 F3000" for i in range(300))]


def heard(port: Port, length: int) -> bytes:
    """The next bytes of a port; fails after a minute of silence."""
    data, end_s = b"", monotonic() + PATIENCE_S
    while len(data) < length and monotonic() < end_s:
        data += port.read()
    return data


@contextmanager
def accepted() -> Iterator[tuple[Port, socket.socket]]:
    """A socket:// port and the other end of its connection."""
    with socket.create_server(("localhost", 0)) as server:
        port = open_port(f"socket://localhost:{server.getsockname()[1]}", 115200)
        host, _ = server.accept()
        with host, port:
            yield port, host


@pytest.mark.parametrize("build", [BuildOptions(), BuildOptions(advanced_ok=False)], ids=["window", "ping-pong"])
def test_a_printer_behind_a_socket_prints_every_line_once(build: BuildOptions) -> None:
    firmware = SimulatedFirmware(MACHINE, build)
    with on_socket(firmware) as address:
        outcome = print_lines(PROGRAM, address, 115200, medium=PATIENT)
    assert (outcome.acknowledged, outcome.repeated) == (301, 0)
    assert [round(x, 5) for x in firmware.record().end[:, 0]] == [float(f"{1 + i % 90}.{i:05d}") for i in range(300)]


def test_a_printer_behind_rfc_2217_prints_every_line_once() -> None:
    with SimulatedPrinter(MACHINE) as printer, behind_rfc2217(printer.path) as address:
        outcome = print_lines(PROGRAM, address, 115200, medium=PATIENT)
        record = printer.record
    assert (outcome.acknowledged, outcome.repeated) == (301, 0)
    assert [round(x, 5) for x in record.end[:, 0]] == [float(f"{1 + i % 90}.{i:05d}") for i in range(300)]


def test_a_read_over_a_socket_takes_all_that_is_there() -> None:
    with accepted() as (port, host):
        host.sendall(b"ok N1 P15 B3\n" * 50)
        while not (data := port.read()):
            continue
        assert data == b"ok N1 P15 B3\n" * 50


def test_bytes_of_every_value_pass_through_rfc_2217() -> None:
    every = bytes(range(256))
    master, slave = pty.openpty()
    os.set_blocking(master, True)
    with behind_rfc2217(os.ttyname(slave)) as address, open_port(address, 115200) as port:
        port.write(every)
        assert os.read(master, 4096) == every
        os.write(master, every)
        assert heard(port, 256) == every
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize("baud", [57600, 1000000])
def test_the_rate_of_a_port_can_be_changed_while_it_is_open(baud: int) -> None:
    with on_terminal(lambda data, rate: b"%d\n" % rate) as path, open_port(path, 115200) as port:
        port.set_baud(baud)
        port.write(b"?")
        assert heard(port, 3) == b"%d\n" % baud
    assert baud in RATES.values()


def test_the_rate_is_set_at_the_far_end_of_rfc_2217() -> None:
    with (
        on_terminal(lambda data, rate: b"%d\n" % rate) as path,
        behind_rfc2217(path) as address,
        open_port(address, 115200) as port,
    ):
        port.set_baud(57600)
        port.write(b"?")
        assert heard(port, 6) == b"57600\n"


@pytest.mark.parametrize("address", ["socket://localhost", "socket://:5000", "rfc2217://localhost:x", "socket://h:70000"])
def test_an_address_without_host_and_port_says_how_one_is_written(address: str) -> None:
    with pytest.raises(PortError, match=r"is not complete: (socket|rfc2217)://HOST:PORT is expected"):
        open_port(address, 115200)


@pytest.mark.parametrize(("address", "words"), [
    ("socket://localhost:1", "connection refused"),
    ("rfc2217://localhost:1", "connection refused"),
    ("socket://no-such-host.invalid:5000", "no such host"),
])  # fmt: skip
def test_a_network_port_without_a_listener_gives_a_one_line_error(address: str, words: str) -> None:
    with pytest.raises(PortError, match=rf"^port {address} cannot be opened: .*{words}$"):
        open_port(address, 115200)


def test_a_server_that_does_not_speak_rfc_2217_is_refused() -> None:
    with on_socket(SimulatedFirmware(MACHINE)) as address, pytest.raises(PortError, match=r"cannot be opened: .*support rfc2217"):
        open_port(address.replace("socket://", "rfc2217://") + "?timeout=0.3", 115200)


def test_a_connection_closed_by_the_other_end_is_lost() -> None:
    with accepted() as (port, host):
        host.close()
        with pytest.raises(PortError, match="was lost: is the printer or the network down"):
            port.read()


def test_a_disconnected_rfc_2217_server_is_a_lost_connection() -> None:
    master, slave = pty.openpty()
    with behind_rfc2217(os.ttyname(slave)) as address, open_port(address, 115200) as port:
        os.close(master)
        os.close(slave)
        with pytest.raises(PortError, match="was lost"):
            heard(port, 1)


def test_a_network_printer_that_stops_reading_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port_module, "WRITE_S", 0.2)
    with accepted() as (port, _), pytest.raises(PortError, match=r"has stopped reading: it took no bytes for 0\.2 s"):
        port.write(b"x" * 64_000_000)


def test_a_network_printer_lost_in_mid_print_ends_it_and_leaves_no_thread() -> None:
    before = set(threading.enumerate())
    firmware = SimulatedFirmware(MACHINE)
    with socket.create_server(("localhost", 0)) as server:

        def serve() -> None:
            host, _ = server.accept()
            server.close()
            with host:
                while firmware.record().lines < 100:
                    firmware.receive(host.recv(4096))
                    host.sendall(firmware.advance())

        thread, address = threading.Thread(target=serve), f"socket://localhost:{server.getsockname()[1]}"
        thread.start()
        with pytest.raises(PortError, match=r"was lost.*its heaters may still be on"):
            print_lines(PROGRAM, address, 115200, medium=replace(PATIENT, lost_s=0.2))
        thread.join(PATIENCE_S)
    assert set(threading.enumerate()) <= before


def test_a_closed_port_stays_closed() -> None:
    with accepted() as (port, _):
        port.close()
        port.close()
        with pytest.raises(PortError, match="was lost"):
            port.write(b"G28\n")


@pytest.mark.skipif(os.name != "posix", reason="a port has the descriptor there")
def test_a_closed_port_touches_no_file_that_has_its_descriptor_since(tmp_path: Path) -> None:
    with accepted() as (port, _):
        number, file = port._device.fileno(), tmp_path / "other"
        port.close()
        file.write_bytes(b"text")
        descriptor = os.open(file, os.O_RDWR)
        os.dup2(descriptor, number)
        try:
            with pytest.raises(PortError, match="was lost"):
                port.write(b"G28\n")
            with pytest.raises(PortError, match="was lost"):
                port.read()
        finally:
            for held in {descriptor, number}:
                os.close(held)
        assert file.read_bytes() == b"text"


def test_serial_devices_are_listed_once_with_stable_names_first(monkeypatch: pytest.MonkeyPatch) -> None:
    class Found:
        def __init__(self, device: str, product: str | None, number: str | None) -> None:
            self.device, self.product, self.serial_number = device, product, number
            self.manufacturer, self.description = None, "n/a"
            self.vid, self.pid = (0x2341, 0x42) if product else (None, None)
            self.location = "1-1.2" if product else None

    ports = [Found("/dev/ttyS0", None, None), Found("/dev/ttyACM0", "Mega 2560", "7533")]
    monkeypatch.setattr(port_module.list_ports, "comports", lambda: ports)
    monkeypatch.setattr(port_module, "_stable_names", lambda: {"/dev/ttyACM0": "/dev/serial/by-id/usb-Mega"})
    devices = [(device.name, device.path, device.description, device.serial_number) for device in serial_devices()]
    assert devices == [
        ("/dev/serial/by-id/usb-Mega", "/dev/ttyACM0", "Mega 2560 (2341:0042)", "7533"),
        ("/dev/ttyS0", "/dev/ttyS0", "", ""),
    ]


def adapter(path: str, number: str = "7533", socket_: str = "1-1.2", model: str = "2341:0042") -> SerialDevice:
    return SerialDevice(path, path, "", number, model, socket_)


HOME = adapter("/dev/ttyACM0")


@pytest.mark.parametrize(("lost", "there", "found"), [
    (HOME, [adapter("/dev/ttyACM1")], "/dev/ttyACM1"),
    (HOME, [adapter("/dev/ttyACM1", socket_="3-2")], "/dev/ttyACM1"),  # plugged into another socket
    (HOME, [], None),
    (HOME, [adapter("/dev/ttyACM0", number="9999")], None),  # another device of the same model has taken its name
    (HOME, [adapter("/dev/ttyACM0", model="1a86:7523")], None),
    (HOME, [adapter("/dev/ttyACM1", socket_="3-2"), adapter("/dev/ttyACM2")], "/dev/ttyACM2"),  # two devices with one number
    (HOME, [adapter("/dev/ttyACM1", socket_="3-2"), adapter("/dev/ttyACM2", socket_="3-3")], None),
    (adapter("/dev/ttyUSB0", ""), [adapter("/dev/ttyUSB1", "")], "/dev/ttyUSB1"),
    (adapter("/dev/ttyUSB0", ""), [adapter("/dev/ttyUSB0", "", socket_="3-2")], None),
    (adapter("/dev/ttyUSB0", ""), [adapter("/dev/ttyUSB0", "9999")], None),
    (adapter("COM3", "", ""), [adapter("COM4", "", "")], None),  # neither number nor socket: only the name is known
    (adapter("COM3", "", ""), [adapter("COM3", "", "")], "COM3"),
])  # fmt: skip
def test_a_lost_adapter_is_identified_by_its_serial_number_or_socket_and_never_confused(
    lost: SerialDevice, there: list[SerialDevice], found: str | None
) -> None:
    device = find_again(lost, there)
    assert (None if device is None else device.path) == found


def test_a_device_is_known_by_its_path_and_by_its_stable_name() -> None:
    stable = replace(HOME, name="/dev/serial/by-id/usb-Mega")
    for name in ("/dev/ttyACM0", "/dev/serial/by-id/usb-Mega"):
        assert find_device(name, [adapter("/dev/ttyACM1"), stable]) is stable
    assert find_device("socket://printer:23", [stable]) is None


def test_a_printer_that_returns_under_another_name_continues_and_its_new_port_is_reported() -> None:
    printer = VirtualPrinter(MACHINE, faults=FaultScript((Fault("disconnect", 30, unit="line", seconds=2.0),)))
    opened, messages = list[str](), list[str]()

    def devices() -> tuple[SerialDevice, ...]:
        another = adapter("/dev/ttyACM0", number="9999")
        return (adapter("/dev/ttyACM1"), another) if opened else (HOME,)

    def open_it(name: str, baud: int) -> Wire:
        wire = printer.medium.open(name, baud)
        opened.append(name)
        return wire

    medium = replace(printer.medium, open=open_it, devices=devices)
    lines = HEAT + strokes(60)
    outcome = print_lines(lines, "/dev/ttyACM0", medium=medium, on_progress=lambda moment: messages.append(moment.message))
    assert_executed(printer.record, lines)
    assert (outcome.cancelled, opened) == (False, ["/dev/ttyACM0", "/dev/ttyACM1"])
    assert "the printer has come back at /dev/ttyACM1" in messages


def test_another_printer_under_the_name_of_the_lost_one_is_never_opened() -> None:
    printer = VirtualPrinter(MACHINE, faults=FaultScript((Fault("disconnect", 30, unit="line", seconds=2.0),)))
    opened = list[str]()

    def devices() -> tuple[SerialDevice, ...]:
        return (adapter("/dev/ttyACM0", number="9999" if opened else "7533"),)

    def open_it(name: str, baud: int) -> Wire:
        opened.append(name)
        return printer.medium.open(name, baud)

    medium = replace(printer.medium, open=open_it, devices=devices)
    with pytest.raises(PortError, match="it did not come back within 120 s"):
        print_lines(HEAT + strokes(60), "/dev/ttyACM0", medium=medium)
    assert opened == ["/dev/ttyACM0"]
