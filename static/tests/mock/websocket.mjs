// The server's half of a WebSocket (RFC 6455), as much as a test needs: text frames, no fragments, no extensions.

import { createHash } from "node:crypto";

/**
 * @param {import("node:http").IncomingMessage} request
 * @param {import("node:net").Socket} socket
 * @param {(text: string) => void} onText
 */
export function acceptWebSocket(request, socket, onText) {
  const key = createHash("sha1")
    .update(`${request.headers["sec-websocket-key"]}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`)
    .digest("base64");
  socket.write(
    `HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ${key}\r\n\r\n`,
  );
  let pending = Buffer.alloc(0);
  socket.on("data", (/** @type {Buffer} */ chunk) => {
    pending = Buffer.concat([pending, chunk]);
    for (;;) {
      const frame = readFrame(pending);
      if (!frame) return;
      pending = pending.subarray(frame.size);
      if (frame.opcode === 8) socket.end();
      if (frame.opcode === 1) onText(frame.payload.toString("utf8"));
    }
  });
  socket.on("error", () => socket.destroy());
  return {
    /** @param {unknown} message */
    send(message) {
      if (socket.destroyed || socket.writableEnded) return;
      const payload = Buffer.from(JSON.stringify(message));
      const head =
        payload.length < 126
          ? Buffer.from([0x81, payload.length])
          : payload.length < 65536
            ? Buffer.from([0x81, 126, payload.length >> 8, payload.length & 255])
            : Buffer.concat([Buffer.from([0x81, 127, 0, 0, 0, 0]), uint32(payload.length)]);
      socket.write(Buffer.concat([head, payload]));
    },
    cut: () => socket.destroy(),
  };
}

/** @param {number} value */
function uint32(value) {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32BE(value);
  return bytes;
}

/** @param {Buffer} bytes */
function readFrame(bytes) {
  if (bytes.length < 2) return null;
  let length = bytes[1] & 127;
  let at = 2;
  if (length === 126) {
    if (bytes.length < 4) return null;
    length = bytes.readUInt16BE(2);
    at = 4;
  } else if (length === 127) {
    if (bytes.length < 10) return null;
    length = bytes.readUInt32BE(6);
    at = 10;
  }
  const masked = (bytes[1] & 128) !== 0;
  const mask = masked ? bytes.subarray(at, at + 4) : Buffer.alloc(4);
  if (masked) at += 4;
  if (bytes.length < at + length) return null;
  const payload = Buffer.from(bytes.subarray(at, at + length));
  for (let i = 0; i < payload.length; i++) payload[i] ^= mask[i % 4];
  return { opcode: bytes[0] & 15, payload, size: at + length };
}
