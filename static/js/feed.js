// The dashboard feed: opens it, asks for what was missed, notices when it has died, tries again.
// First load, reconnect and lag are one path: say hello, apply what comes.

/** Silence longer than this is a dead link; the server sends a heartbeat every 2 s. */
export const DEAD_AFTER_MS = 5_000;
export const FIRST_RETRY_MS = 500;
export const LAST_RETRY_MS = 15_000;

/**
 * What the feed needs of a WebSocket.
 * @typedef {{
 *   send(text: string): void, close(): void,
 *   onopen: ((event: any) => void) | null, onmessage: ((event: any) => void) | null,
 *   onclose: ((event: any) => void) | null, onerror: ((event: any) => void) | null,
 * }} Socket
 * @typedef {{
 *   makeSocket: () => Socket,
 *   resume: () => {since: number, boot: string} | null,
 *   onMessage: (message: any) => {gap: boolean},
 *   onLink: (up: boolean) => void,
 *   after?: (ms: number, run: () => void) => () => void,
 *   random?: () => number,
 * }} FeedParts `after` runs something later and returns how to call it off
 */

export class Feed {
  /** @param {FeedParts} parts */
  constructor(parts) {
    this.parts = parts;
    this.after = parts.after ?? afterTimeout;
    this.random = parts.random ?? Math.random;
    this.tries = 0;
    this.up = false;
    /** @type {Socket | null} */
    this.socket = null;
    this.callOffRetry = () => {};
    this.callOffWatch = () => {};
  }

  /** Opens the feed, or, when it waits for its next try, tries now. */
  open() {
    if (this.socket) return;
    this.callOffRetry();
    const socket = this.parts.makeSocket();
    this.socket = socket;
    this.watch();
    socket.onopen = () => this.hello(this.parts.resume());
    socket.onmessage = (event) => {
      if (socket === this.socket) this.take(event.data);
    };
    socket.onclose = () => this.lose(socket);
    socket.onerror = () => this.lose(socket);
  }

  /** @param {{since: number, boot: string} | null} resume */
  hello(resume) {
    this.socket?.send(JSON.stringify({ type: "hello", ...(resume ?? {}) }));
  }

  /** @param {string} text */
  take(text) {
    this.watch();
    this.tries = 0;
    const { gap } = this.parts.onMessage(JSON.parse(text));
    // Messages were missed on a living link: a hello without a place to go on from brings a snapshot.
    if (gap) this.hello(null);
    if (!this.up) {
      this.up = true;
      this.parts.onLink(true);
    }
  }

  /** Calls a link dead that has been silent for too long. */
  watch() {
    this.callOffWatch();
    this.callOffWatch = this.after(DEAD_AFTER_MS, () => {
      const silent = this.socket;
      if (silent) this.lose(silent);
    });
  }

  /** @param {Socket} socket */
  lose(socket) {
    // A socket reports an error and then its close; and an old one may close after the next has opened.
    if (socket !== this.socket) return;
    this.socket = null;
    this.callOffWatch();
    socket.close();
    if (this.up) {
      this.up = false;
      this.parts.onLink(false);
    }
    const ceiling = Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.tries);
    this.tries += 1;
    // Spread the tries of many dashboards after a server restart.
    this.callOffRetry = this.after(ceiling * (0.5 + this.random() / 2), () => this.open());
  }
}

/**
 * @param {number} ms
 * @param {() => void} run
 */
function afterTimeout(ms, run) {
  const id = setTimeout(run, ms);
  return () => clearTimeout(id);
}
