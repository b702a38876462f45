"""A client of WebSockets for the tests of the console."""
import base64
import hashlib
import json
import os
import re
import socket
import struct
import time


class WebSocket:
    """As little of RFC 6455 as a test needs."""

    def __init__(self, port, path="/ws", protocols="foxglove.websocket.v1", **headers):
        self.socket = socket.create_connection(("127.0.0.1", port), 20)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                 f"Sec-WebSocket-Key: {key}", f"Sec-WebSocket-Protocol: {protocols}", *(f"{k}: {v}" for k, v in headers.items())]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            got = self.socket.recv(4096)
            assert got, self.bytes
            self.bytes += got
        head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        self.status = int(head.split()[1])
        found = re.search(rb"Sec-WebSocket-Protocol: (\S+)", head)
        self.protocol = found[1].decode() if found else None
        if self.status == 101:
            assert base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()) in head
        self.topics, self.by_id, self.messages, self.ops = {}, {}, {}, []
        self.closed = False

    def send(self, payload, code=1):
        mask = os.urandom(4)
        size = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0xFE, len(payload)) if len(payload) < 65536 else struct.pack("!BQ", 0xFF, len(payload))
        self.socket.sendall(bytes([0x80 | code]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def op(self, **json_of_it):
        self.send(json.dumps(json_of_it).encode())

    def read(self, seconds):
        end = time.time() + seconds
        while not self.closed and (left := end - time.time()) > 0:
            while self.frame():
                pass
            self.socket.settimeout(left)
            try:
                got = self.socket.recv(1 << 20)
            except TimeoutError:
                return
            except ConnectionError:
                got = b""
            self.closed = not got
            self.bytes += got

    def frame(self):
        if len(self.bytes) < 2:
            return False
        size, at = self.bytes[1] & 127, 2
        if size == 126 and len(self.bytes) >= 4:
            (size,), at = struct.unpack_from("!H", self.bytes, 2), 4
        elif size == 127 and len(self.bytes) >= 10:
            (size,), at = struct.unpack_from("!Q", self.bytes, 2), 10
        elif size >= 126:
            return False
        if len(self.bytes) < at + size:
            return False
        code, payload, self.bytes = self.bytes[0] & 15, self.bytes[at:at + size], self.bytes[at + size:]
        if code == 1:
            message = json.loads(payload)
            self.ops.append(message)
            for channel in message.get("channels", []):
                self.topics[channel["topic"]] = channel
                self.by_id[channel["id"]] = channel
        elif code == 2:
            kind, subscription, ns = struct.unpack_from("<BIQ", payload)
            assert kind == 1
            channel = self.by_id[subscription]  # tests subscribe with the id of the channel
            data = json.loads(payload[13:]) if channel["encoding"] == "json" else payload[13:]
            self.messages.setdefault(channel["topic"], []).append(data)
        elif code == 8:
            self.closed = True
        return True

    def subscribe(self, *topics):
        self.op(op="subscribe", subscriptions=[{"id": self.topics[t]["id"], "channelId": self.topics[t]["id"]} for t in topics])

    def until(self, ready, seconds=30):
        end = time.time() + seconds
        while not ready() and not self.closed and time.time() < end:
            self.read(0.1)
        assert ready(), (self.topics.keys(), {t: len(m) for t, m in self.messages.items()}, self.ops[-3:])
