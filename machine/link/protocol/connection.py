"""The sender's side of the serial protocol without I/O: received bytes go in, events and bytes to send come out.

The caller owns port and clock: it writes the bytes of take(), passes received bytes to receive() and calls tick() regularly.

Every line has a number and a checksum. The printer accepts lines in order only: it answers `ok` to each, and `Resend: n` when n
is damaged or missing, after which it accepts nothing until n has come. Several lines are in flight at once (the window), so each
answer must be assigned to its line; only lines known to be missing are sent again, for a line run twice spoils the print.

    sender                            printer
    N8 G1 X1*105  ----------------->  ok                  OPEN
    N9 G1 X2*107  -------##--------   Resend: 9           damaged in transit; N10 is in flight, too:
    N10 G1 X3*82  ----------------->  Resend: 9           not accepted, for 9 is missing
                                                          QUIET: nothing is sent until no more answers come
    N9 G1 X2*107  ----------------->  ok                  REPEAT: from the history, one by one
    N10 G1 X3*82  ----------------->  ok                  then OPEN again, at first with one line at a time
    N11 G1 X4*84  ----------------->  (ok gets lost)      PROBING: silence for too long, so a question with a number
    N12 M105*20   ----------------->  ok T:205            answered: N11 has arrived, too; `Resend: 11`: it has not

Bytes become events, events or the passing of time become signals, and the table gives the next state:

    bytes -> LineDecoder -> Event -> _handle -> Signal -> TABLE[state] -> _enter -> take()
                       tick -> Timeouts -------^
"""

from machine.link.protocol import verdict
from machine.link.protocol.answers import ASKED_LIMIT, QUESTION, QUESTIONS_MOST, Acknowledgement, Questions, Resends
from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.framing import LINE_LIMIT, frame
from machine.link.protocol.greeting import GREETING, PLAIN_QUESTION, Greeting
from machine.link.protocol.states import TABLE, Signal, State
from machine.link.protocol.timeout import Timeouts, Timing
from machine.link.protocol.window import FIRST_NUMBER_AGAIN, GREETING_LINES, Window
from profiles.errors import PrinterError, SilenceError

BEFORE_NUMBERS = (State.DRAIN, State.SYNC)  # an error concerns what came before: no line sent here has a number yet
GREETING_STATES = (*BEFORE_NUMBERS, State.HELLO)


class Connection:
    """A conversation with a printer.

    `fault` is the error that ended it, None while it lasts: check it after receive() and tick(). `halted`: the firmware reports
    that it has stopped for good. `greeting` holds the answer to M115, `window` counts the lines, `resends` those repeated.
    rx_bytes: size of the machine's receive buffer, None: its firmware's; baud: for messages.
    """

    def __init__(
        self,
        timing: Timing | None = None,
        now_s: float = 0.0,
        *,
        limit: int = LINE_LIMIT,
        rx_bytes: int | None = None,
        baud: int | None = None,
    ) -> None:
        self.state = State.DRAIN
        self.fault: PrinterError | None = None
        self.greeting = Greeting(rx_bytes, baud)
        self.window = Window(limit, self.greeting.rx_bytes)
        self.resends = Resends()
        self._decoder, self._oks, self._questions = LineDecoder(), Acknowledgement(), Questions()
        self._timeouts = Timeouts(timing or Timing(), now_s)
        self._out = bytearray()
        self._last_number_used = False
        self.halted = False

    def can_send(self, command: str) -> bool:
        """Whether this command may be sent now."""
        if self.state is not State.OPEN or self._last_number_used or self._decoder.incomplete:
            return False
        greeting = self.greeting
        return self.window.has_space(command, greeting.firmware.line, greeting.emergency_parser)

    def send(self, command: str, now_s: float) -> int:
        """Number a command, keep it for repeats and queue its bytes. Returns its line number, counted from the greeting; 0: there
        is no space and nothing is sent."""
        if not self.can_send(command):
            return 0
        self._send(command, now_s)
        last_number = self.greeting.firmware.line.last_number
        self._last_number_used = not self.greeting.keeps_numbers and self.window.wire_number(self.window.sent) >= last_number
        return self.window.sent

    def take(self) -> bytes:
        """Remove and return the bytes to write to the port."""
        out = bytes(self._out)
        self._out.clear()
        return out

    def receive(self, data: bytes, now_s: float) -> list[Event]:
        """The events of received bytes, split anywhere."""
        self._timeouts.heard_s = now_s
        received = self._decoder.receive(data, now_s)
        for event in received:
            self._handle(event, now_s)
        return received

    def tick(self, now_s: float) -> None:
        """Note the time, for drains, pauses before a repeat, and stalls."""
        for event in self._decoder.flush(now_s):
            self._handle(event, now_s)
        signal = self._timeouts.signal(self.state, self.window, self.greeting.firmware.line, self._questions.unanswered, now_s)
        if signal is None and self._last_number_used and not self.window.flight:
            signal = Signal.LAST_NUMBER
        if signal is not None:
            self._follow(signal, now_s)

    def reconnect(self, now_s: float, done: bool | None = None) -> None:
        """Continue over a new port: the printer is asked which lines arrived; a restarted one reveals itself.

        done: what is known otherwise: whether the lines in flight were executed, or are to be sent again.
        """
        # An unfinished line is refused together with the question after it, and requested again; some firmwares would answer an
        # empty line. Firmwares that never request lines were queried for their status, which ended it.
        self._out.clear()
        self._decoder.discard_partial()
        self._questions.unanswered = 0
        if done:
            self.window.acknowledge(self.window.sent)
        elif done is False:
            unanswered = [line.number for line in self.window.flight if not line.asks_temperature]
            self.window.clear_flight()
            for number in unanswered:
                self._out += self.window.repeat(number, now_s)
        self._follow(Signal.RECONNECTED, now_s)

    def _send(self, command: str, now_s: float) -> None:
        if not self.window.flight:
            self._timeouts.progress_s = now_s
        self._out += self.window.send(command, now_s)

    def _handle(self, event: Event, now_s: float) -> None:
        if event.identity or event.kind is Kind.CAPABILITY:
            self.greeting.learn(event)
            self.window.rx_bytes = self.greeting.rx_bytes
        match event.kind:
            case Kind.OK:
                self._handle_ok(event, now_s)
            case Kind.RESEND:
                self._handle_resend(event.line or 0, now_s)
            case Kind.LINE_ERROR if self.state in BEFORE_NUMBERS:
                self.greeting.heard = event.text
            case Kind.LINE_ERROR:
                self.resends.words = event.text
                self._oks.expect_resend_ok(self._timeouts.hear_line_error(now_s))
            case Kind.BUSY:
                self.greeting.heard = event.text
                self._timeouts.hear_busy(now_s)
            case Kind.BANNER if self.state in GREETING_STATES:
                pass  # it follows a `start` that was handled
            case Kind.START | Kind.BANNER:
                self._follow(Signal.START, now_s, verdict.restart(self.window.last_acknowledged))
            case Kind.FAULT:
                self.halted = self.halted or event.is_halt
                self._follow(Signal.FAULT, now_s, verdict.firmware_fault(event.text))
            case Kind.WAIT:
                if self._questions.hear_idle(bool(self.window.flight)):
                    self._follow(Signal.STALL, now_s)
            case Kind.ECHO:
                self._oks.hear_echo(event.text)

    def _handle_ok(self, ok: Event, now_s: float) -> None:
        """Handle an `ok`, which answers M110, a Resend or a line in flight, depending on the state."""
        unknown = self._oks.take_unknown()
        if ok.line is not None:
            self.window.learn(ok.rx_free)
            if self.state is State.OPEN:  # nearly every answer
                self._acknowledge(self.window.line_number(ok.line), False, now_s)
                return
        elif ok.planner_free is not None and self.window.numbered and not unknown:
            self._follow(Signal.UNCHECKED, now_s, verdict.torn_line(self.window.last_acknowledged))
            return
        if self.state is State.SYNC:
            if self.greeting.asked_plainly and self.greeting.identity:
                self._follow(Signal.SILENT, now_s, verdict.no_line_numbers())
            elif ok.line is not None or ok.planner_free is None:  # else it belongs to the rest of a line torn by a restart
                self._follow(Signal.SYNCED, now_s)
        elif self.state is State.QUIET:
            if self.resends.alone and ok.line is None and ok.temperature is None:
                self._follow(Signal.HUSH, now_s)  # the ok that belongs to the Resend, with nothing else in flight
        elif self.state is State.RENUMBER:
            if self._oks.answers_m110(ok, self.window.numbered, unknown, now_s):
                self.window.restart_numbers()
                self._last_number_used = False
                self._follow(Signal.SYNCED, now_s)
        else:
            self._acknowledge(self._oks.line(ok, self.window, self.window.numbered, now_s), ok.temperature is not None, now_s)

    def _acknowledge(self, number: int | None, to_question: bool, now_s: float) -> None:
        """Note that this line and all before it have arrived; an answer to a line not in flight is ignored.

        to_question: it answers an M105. Only questions follow the first one asked in trouble.
        """
        window = self.window
        if number is None or not window.flight:
            return
        oldest = window.flight[0]
        if to_question and self.state is State.PROBING and number >= self._questions.first:
            if not self.greeting.firmware.line.resends and not oldest.asks_temperature:
                lost, command = window.wire_number(oldest.number), window.command(oldest.number)
                self._follow(Signal.UNCHECKED, now_s, verdict.lost_answer(lost, command, self.greeting.firmware.name))
                return
            number = window.sent
        if not window.acknowledge(number):
            return
        self.resends.acknowledge(number)
        self._timeouts.acknowledge(oldest, now_s)
        self._questions.acknowledge()
        if self.state is State.HELLO and number < GREETING_LINES:
            self._send(QUESTION, now_s)
        elif self.state is State.HELLO:
            self._follow(Signal.GREETED, now_s)
        elif (self.state is State.PROBING and number >= self._questions.first) or (
            self.state is State.REPEAT and not window.flight
        ):
            self._follow(Signal.ANSWERED, now_s)

    def _handle_resend(self, wire_number: int, now_s: float) -> None:
        if self.state is State.SYNC:
            self.greeting.wanted = wire_number
            return
        ok_until_s = self._timeouts.hear_resend(now_s, self.state is State.RENUMBER)
        if self.greeting.firmware.line.resend_ok:
            self._oks.expect_resend_ok(ok_until_s)
        if self.state is State.RENUMBER:
            return
        window = self.window
        number = window.line_number(wire_number)
        plausible = window.can_mean(number)
        if self.state is State.HELLO:
            self.greeting.wanted = wire_number
            self._follow(Signal.RESEND, now_s)
        elif plausible and self.state is not State.QUIET:
            if too_much := self.resends.request(number):
                self._follow(Signal.IMPOSSIBLE, now_s, self._refusal(number, too_much))
                return
            window.acknowledged = number - 1
            self._follow(Signal.RESEND, now_s)
        elif plausible:
            self.resends.next_line = number
        elif self.state is State.PROBING and self._questions.implausible == number:
            error = verdict.implausible_resend(wire_number, window.wire_number(window.sent), window.last_acknowledged)
            self._follow(Signal.IMPOSSIBLE, now_s, error)
        else:
            self._questions.implausible = number
            self._follow(Signal.IMPLAUSIBLE, now_s)

    def _refusal(self, number: int, too_much: str) -> PrinterError:
        """The error when lines are no longer repeated: the printer refuses one as it is, or too many."""
        line, command = self.window.wire_number(number), self.window.command(number)
        if self.resends.same_line and command:
            return verdict.refused_line(line, command, ASKED_LIMIT, self.resends.words)
        return verdict.noise(line, too_much)

    def _follow(self, signal: Signal, now_s: float, error: PrinterError | None = None) -> None:
        """Make the table's transition, then act on entering the state."""
        state = TABLE[self.state].get(signal)
        if state is None:
            return
        self.state = state
        self._timeouts.enter(now_s)
        if state in (State.HALTED, State.LOST):
            self.fault = error or verdict.silence(self.window.last_acknowledged, self._questions.unanswered)
            self._out.clear()
        elif state in (State.PROBING, State.RENUMBER):
            self._ask(now_s)
        else:
            self._enter(signal, now_s)

    def _enter(self, signal: Signal, now_s: float) -> None:
        """Send what is due on entering a state, and note what is known then."""
        match self.state:
            case State.SYNC:
                self._greet(now_s)
            case State.HELLO:
                self._send("M115", now_s)
            case State.OPEN:
                self._questions.end()
            case State.QUIET:
                self._questions.end()
                self.window.back_off()
                self.resends.alone = self.window.sent <= self.resends.next_line
                self.window.clear_flight()
            case State.REPEAT:
                if signal is Signal.HUSH:
                    self._oks.expect_resend_ok(now_s)  # it has come, or will not
                if framed := self.resends.repeat(self.window, now_s):
                    self._out += framed
                else:
                    self._follow(Signal.CAUGHT_UP, now_s)

    def _greet(self, now_s: float) -> None:
        """Begin the line numbers with M110, or where a firmware without it expects them; a limited number of times."""
        first = self.greeting.attempt(self._decoder)
        if isinstance(first, SilenceError) and not self.greeting.asked_plainly:
            self.greeting.asked_plainly = True
            self._out += PLAIN_QUESTION
        elif isinstance(first, PrinterError):
            self._follow(Signal.SILENT, now_s, first)
        else:
            self.window.reset(first or 1)
            if first:
                self._follow(Signal.SYNCED, now_s)
            else:
                self._out += GREETING

    def _ask(self, now_s: float) -> None:
        """Ask what has arrived, or repeat M110, which is not checked for sequence; a limited number of times."""
        if self.state is State.PROBING:
            self.window.slow_down()
        if not self._questions.ask():
            self._follow(Signal.SILENT, now_s, verdict.silence(self.window.last_acknowledged + 1, QUESTIONS_MOST))
        elif self.state is State.PROBING:
            self._send(QUESTION, now_s)
            self._questions.first = self._questions.first or self.window.sent
        else:  # firmwares read one N or the other
            self._out += frame(FIRST_NUMBER_AGAIN, f"M110 N{FIRST_NUMBER_AGAIN}")
