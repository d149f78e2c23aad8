// A page of elements that only remember what is done to them, sockets that go nowhere, and a clock that a test turns.

const fake = (() => {
  const timers = [], sockets = [], keys = {}, elements = {};
  let now_ms = 0;

  function element(id) {
    const listeners = {};
    return {
      id, hidden: id === "emergency", textContent: "", value: "", dataset: {}, options: [], children: [], contentWindow: { addEventListener() {} },
      addEventListener: (event, act) => { (listeners[event] ||= []).push(act); },
      fire: (event) => (listeners[event] || []).forEach((act) => act({ target: {} })),
      setAttribute() {}, getAttribute() {}, append() {}, hidePopover() {}, querySelector: () => element(""), querySelectorAll: () => [],
      replaceChildren(...children) { this.children = children; },
    };
  }

  class Socket {
    static OPEN = 1;
    constructor(address) { Object.assign(this, { address: String(address), readyState: 0, sent: [] }); sockets.push(this); }
    send(text) { this.sent.push(JSON.parse(text)); }
    open() { this.readyState = 1; this.onopen(); }
    lose(code = 1006) { this.readyState = 3; this.onclose({ code }); }
    tell(state) { this.onmessage({ data: JSON.stringify(state) }); }
  }

  Object.defineProperty(globalThis, "performance", { value: { now: () => now_ms } });
  Date.now = () => now_ms;
  Object.assign(globalThis, {
    window: globalThis,
    WebSocket: Socket,
    location: { href: "http://127.0.0.1:8000/token/1/", origin: "http://127.0.0.1:8000", pathname: "/token/1/" },
    document: { getElementById: (id) => (elements[id] ||= element(id)), documentElement: element(""), createElement: element, querySelector: () => null },
    addEventListener: (event, act) => (keys[event] ||= []).push(act),
    setInterval: (act, every_ms) => { const again = () => { act(); setTimeout(again, every_ms); }; setTimeout(again, every_ms); },
    setTimeout: (act, after_ms, ...given) => timers.push({ act, given, at_ms: now_ms + after_ms }),
    clearTimeout: (number) => { if (number) timers[number - 1].done = true; },
  });

  return {
    sockets,
    /** All that was sent, in the order of the sockets. */
    sent: () => sockets.flatMap((each) => each.sent),
    /** A key goes down, event "keydown", or up. */
    press: (key, target = {}, event = "keydown") => keys[event].forEach((act) => act({ key, target, preventDefault() {}, stopPropagation() {} })),
    /** Let time go by, with what is to be done in it. */
    wait: (ms) => {
      const end_ms = now_ms + ms, next = () => timers.filter(({ done, at_ms }) => !done && at_ms <= end_ms).sort((a, b) => a.at_ms - b.at_ms)[0];
      for (let timer = next(); timer; timer = next()) {
        now_ms = timer.at_ms;
        timer.done = true;
        timer.act(...timer.given);
      }
      now_ms = end_ms;
    },
  };
})();
