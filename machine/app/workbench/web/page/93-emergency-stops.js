// Emergency stops: what has been asked for and what has become of it.

const SAME_PRESS_MS = 1000; // who presses twice in a fright means the print of the first time

/** Emergency stops, and in the bar at the foot, which nothing covers, what has become of them, until a person has noted it. */
function stopsAsked(prints, send, isOpen) {
  let asked = new Set(), late = 0, pressed = { number: 0, at: -Infinity };
  const going = ({ phase }) => phase !== "over";
  const stopped = () => prints().filter(({ number }) => asked.has(number));
  const say = (text) => {
    if ($("stop-words").textContent !== text) $("stop-words").textContent = text;
    $("stop-told").hidden = !text;
    $("print-bar").hidden = !text && $("emergency").hidden;
  };
  const doubt = () => {
    if (stopped().length ? !stopped().some(going) : isOpen()) return;
    say(isOpen() ? "THE STOP IS NOT CONFIRMED: use the machine's own switch." : "THE STOP HAS NOT ARRIVED, the line to tiltprint is lost: use the machine's own switch.");
  };
  const ask = (number) => {
    if (prints().some((each) => going(each) && each.number === number)) asked.add(number);
    send({ do: "emergency", print: number });
    if (!isOpen()) doubt();
    clearTimeout(late);
    late = setTimeout(doubt, ANSWER_MS);
  };
  $("stop-noted").addEventListener("click", () => { if (!stopped().some(going)) asked = new Set(); say(""); });
  return {
    /** number: of a print. */
    press: (number) => {
      const now = performance.now();
      pressed = { number: now - pressed.at < SAME_PRESS_MS ? pressed.number : number, at: now };
      ask(pressed.number);
    },
    /** One has waited too long for a line, or its print is not there any more. */
    expired: () => { if (stopped().some(going)) say("THE STOP HAS NOT ARRIVED and is not given any more: press it again, or use the machine's own switch."); },
    told: () => { if (stopped().length && !stopped().some(going)) say(stopped().map(({ name, sentence }) => `${name}: ${sentence}.`).join(" ")); },
  };
}
