#!/usr/bin/env python3
"""Prints the poses of a live session, a line of JSON each: poses.py HOST PORT SESSION COUNT [TOKEN]

Nothing but the standard library. The frame is laid out in docs/poses.md.
"""

import base64
import json
import os
import socket
import struct
import sys

STATES = ["aligning", "full", "reduced", "coasting", "silent"]
HEAD = struct.Struct("<4sHHQqIBBBBQ")
BODY = struct.Struct("<6d20fI")
AID = struct.Struct("<HH")
LONG_AGO = 65535


def connect(host, port, session, token):
    """A socket after the handshake of a websocket (RFC 6455)."""
    link = socket.create_connection((host, int(port)))
    link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [
        f"GET /api/v1/sessions/{session}/poses HTTP/1.1",
        f"Host: {host}:{port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
    ]
    if token:
        lines.append(f"Authorization: Bearer {token}")
    link.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    stream = link.makefile("rb")
    status = stream.readline().decode().strip()
    while stream.readline() not in (b"\r\n", b""):
        pass
    if " 101 " not in status:
        raise SystemExit(f"expected 101 Switching Protocols, found {status!r}: check the session and the token")
    return link, stream


def messages(link, stream):
    """Opcode and content of each message; pings are answered."""
    while True:
        head = stream.read(2)
        if len(head) < 2:
            return
        opcode, length = head[0] & 15, head[1] & 127
        if length == 126:
            (length,) = struct.unpack(">H", stream.read(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", stream.read(8))
        content = stream.read(length)
        if opcode == 9:
            mask = os.urandom(4)
            masked = bytes(byte ^ mask[k % 4] for k, byte in enumerate(content))
            link.sendall(bytes([0x8A, 0x80 | len(content)]) + mask + masked)
        elif opcode == 8:
            return
        else:
            yield opcode, content


def body(values):
    *floats, flags = values
    # JSON has no NaN.
    numbers = [x if x == x else None for x in floats]
    return {
        "position_n_m": numbers[0:3],
        "angles_rad": numbers[3:6],
        "velocity_n_m_s": numbers[6:9],
        "rate_n_rad_s": numbers[9:12],
        "sigma_n_m": numbers[12:15],
        "sigma_angles_rad": numbers[15:18],
        "off_plan_n_m": numbers[18:21],
        "off_plan_rad": numbers[21:24],
        "protection_level_m": numbers[24],
        "time_left_s": numbers[25],
        "valid": bool(flags & 4),
        "alarm": bool(flags & 8),
        "flags": flags,
    }


def aid(values, name, is_in, troubles):
    since, trouble = values
    return {
        "name": name,
        "in": is_in,
        "since_s": None if since == LONG_AGO else since / 100,
        "trouble": troubles[trouble - 1] if trouble else None,
    }


def pose(frame, names, troubles):
    magic, version, length, sequence, t_ns, age_us, state, flags, bodies, count, mask = HEAD.unpack_from(frame)
    if magic != b"LPOS" or version != 2 or length != len(frame):
        raise SystemExit(f"expected a frame of version 2, found {frame[:8]!r}: see docs/poses.md")
    read = [BODY.unpack_from(frame, HEAD.size + k * BODY.size) for k in range(bodies)]
    first = HEAD.size + bodies * BODY.size
    aids = [AID.unpack_from(frame, first + k * AID.size) for k in range(count)]
    return {
        "sequence": sequence,
        "t_s": t_ns * 1e-9,
        "age_s": age_us * 1e-6,
        "state": STATES[state],
        "predicted": bool(flags & 1),
        "aids": [aid(aids[k], names[k], bool(mask >> k & 1), troubles) for k in range(count)],
        "bodies": [body(values) for values in read],
    }


def main():
    if len(sys.argv) not in (5, 6):
        raise SystemExit(__doc__.splitlines()[0])
    host, port, session, count = sys.argv[1:5]
    link, stream = connect(host, port, session, sys.argv[5] if len(sys.argv) == 6 else None)
    names, troubles, told = [], [], 0
    for opcode, content in messages(link, stream):
        if opcode == 1:
            first = json.loads(content)
            names, troubles = first["aids"], first["troubles"]
            continue
        print(json.dumps(pose(content, names, troubles)), flush=True)
        told += 1
        if told == int(count):
            return
    raise SystemExit(f"expected {count} poses, found {told}: the socket was closed")


main()
