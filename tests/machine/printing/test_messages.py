"""Which words of a printer are kept for the person who watches."""

import pytest

from machine.printing.messages import PrinterMessages, printer_message


@pytest.mark.parametrize(("line", "text"), [
    (b"ok N3 P15 B3", ""),
    (b" T:20.00 /0.00 B:20.00 /0.00", ""),
    (b"X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0", ""),
    (b"echo:busy: processing", ""),
    (b"Cap:EEPROM:1", ""),
    (b"echo: cold extrusion prevented", "cold extrusion prevented"),
    (b"// probe at 5,5", "probe at 5,5"),
    (b"//action:pause", "the printer asks: pause"),
    (b"Error:Heating failed", "Error:Heating failed"),
    (b"start", "the printer has started"),
])  # fmt: skip
def test_of_what_the_printer_says_only_words_are_kept(line: bytes, text: str) -> None:
    assert printer_message(line) == text


def test_words_cut_anywhere_are_put_together_and_the_last_four_kept() -> None:
    messages, said = PrinterMessages(4), b"".join(b"ok\necho:word %d\n" % n for n in range(9))
    for at in range(0, len(said), 7):
        messages.hear("<", said[at : at + 7])
    messages.hear(">", b"echo:sent\n")
    assert list(messages.last) == ["word 5", "word 6", "word 7", "word 8"]


def test_a_message_that_stays_is_told_once_whatever_the_printer_says_meanwhile() -> None:
    messages = PrinterMessages()
    for text in ("pausing", "pausing", "", "paused"):
        messages.add(text)
        messages.hear("<", b"ok\n" if text else b"echo:busy here\n")
        messages.add(text)
    assert list(messages.last) == ["pausing", "busy here", "paused"]


def test_a_printer_that_never_ends_its_line_takes_no_memory() -> None:
    messages = PrinterMessages()
    for _ in range(100):
        messages.hear("<", b"x" * 1000)
    assert len(messages._half) == 4096


def test_words_said_again_are_one_line_with_a_count() -> None:
    messages = PrinterMessages()
    messages.hear("<", b'echo:Unknown command: "M486 S1"\nok\n' + b'echo:Unknown command: "M486 S-1"\nok\n' * 18 + b"echo:done\n")
    assert list(messages.last) == ["Unknown command: M486 (x 19)", "done"]
