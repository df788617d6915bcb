import assert from "node:assert/strict";
import { test } from "node:test";
import { DEAD_AFTER_MS, Feed } from "../js/feed.js";
import { apply, emptyState } from "../js/state/live.js";

/** A socket and a clock that the test drives by hand. */
function rig() {
  const sockets = [];
  const timers = [];
  const links = [];
  const state = emptyState();
  const feed = new Feed({
    makeSocket() {
      const socket = {
        sent: [],
        closed: false,
        send(text) {
          this.sent.push(JSON.parse(text));
        },
        close() {
          this.closed = true;
        },
        onopen: null,
        onmessage: null,
        onclose: null,
        onerror: null,
      };
      sockets.push(socket);
      return socket;
    },
    resume: () => (state.boot === null ? null : { since: state.seq, boot: state.boot }),
    onMessage: (message) => apply(state, message, 0),
    onLink: (up) => links.push(up),
    after(ms, run) {
      const timer = { ms, run, off: false };
      timers.push(timer);
      return () => {
        timer.off = true;
      };
    },
    random: () => 1,
  });
  const say = (socket, message) => socket.onmessage({ data: JSON.stringify(message) });
  const due = () => timers.filter((timer) => !timer.off);
  const fire = () => {
    const timer = due().at(-1);
    timer.off = true;
    timer.run();
    return timer.ms;
  };
  return { feed, sockets, links, state, say, due, fire };
}
const snapshot = (seq, sessions = []) => ({
  type: "snapshot",
  boot: "b1",
  seq,
  inspectors: [],
  sessions,
  faults: [],
  markers_revision: 0,
});

test("the first hello asks for everything, the second goes on from what was seen, and its messages arrive", () => {
  const { feed, sockets, links, state, say, fire } = rig();
  feed.open();
  sockets[0].onopen();
  assert.deepEqual(sockets[0].sent, [{ type: "hello" }]);
  say(sockets[0], snapshot(7));
  say(sockets[0], { type: "changes", seq: 8, changes: [] });
  assert.deepEqual(links, [true]);

  sockets[0].onclose();
  assert.deepEqual(links, [true, false]);
  fire();
  assert.equal(sockets.length, 2);
  sockets[1].onopen();
  assert.deepEqual(sockets[1].sent, [{ type: "hello", since: 8, boot: "b1" }]);
  say(sockets[1], { type: "changes", seq: 9, changes: [{ kind: "fault", fault: { id: "f", state: "open" } }] });
  assert.equal(state.seq, 9);
  assert.ok(state.faults.has("f"));
  assert.deepEqual(links, [true, false, true]);
});

test("a third connection after a snapshot of another boot starts from there", () => {
  const { feed, sockets, state, say, fire } = rig();
  feed.open();
  sockets[0].onopen();
  say(sockets[0], snapshot(7));
  sockets[0].onclose();
  fire();
  sockets[1].onopen();
  say(sockets[1], { ...snapshot(2), boot: "b2" });
  sockets[1].onclose();
  fire();
  sockets[2].onopen();
  assert.deepEqual(sockets[2].sent, [{ type: "hello", since: 2, boot: "b2" }]);
  assert.equal(state.boot, "b2");
});

test("it backs off between tries up to a limit, and starts over once a message has come", () => {
  const { feed, sockets, say, fire } = rig();
  feed.open();
  const waits = [];
  for (let i = 0; i < 8; i++) {
    sockets.at(-1).onclose();
    waits.push(fire());
  }
  assert.deepEqual(waits, [500, 1000, 2000, 4000, 8000, 15000, 15000, 15000]);
  sockets.at(-1).onopen();
  say(sockets.at(-1), snapshot(1));
  sockets.at(-1).onclose();
  assert.equal(fire(), 500);
});

test("an open link that has gone silent is given up", () => {
  const { feed, sockets, links, say, due, fire } = rig();
  feed.open();
  sockets[0].onopen();
  say(sockets[0], snapshot(1));
  assert.deepEqual(
    due().map((timer) => timer.ms),
    [DEAD_AFTER_MS],
  );
  fire();
  assert.equal(sockets[0].closed, true);
  assert.deepEqual(links, [true, false]);
});

test("an old socket that closes late does not take the new one down", () => {
  const { feed, sockets, links, say, fire } = rig();
  feed.open();
  sockets[0].onopen();
  say(sockets[0], snapshot(1));
  sockets[0].onerror();
  fire();
  sockets[1].onopen();
  say(sockets[1], snapshot(2));
  sockets[0].onclose();
  assert.equal(sockets.length, 2);
  assert.equal(links.at(-1), true);
});

test("a hole in the sequence is mended on the living link by asking for a snapshot", () => {
  const { feed, sockets, state, say } = rig();
  feed.open();
  sockets[0].onopen();
  say(sockets[0], snapshot(7));
  say(sockets[0], { type: "changes", seq: 9, changes: [] });
  assert.deepEqual(sockets[0].sent.at(-1), { type: "hello" });
  say(sockets[0], snapshot(9));
  say(sockets[0], { type: "changes", seq: 10, changes: [] });
  assert.equal(state.seq, 10);
});

test("asking to open while a try is waiting tries at once, and only once", () => {
  const { feed, sockets, due } = rig();
  feed.open();
  sockets[0].onclose();
  feed.open();
  feed.open();
  assert.equal(sockets.length, 2);
  assert.deepEqual(
    due().map((timer) => timer.ms),
    [DEAD_AFTER_MS],
  );
});
