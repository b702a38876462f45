"""A listener of the live feed in another language, written from docs/formats.md alone."""
import json
import os
import select
import socket
import struct
import time


class Feed:
    def __init__(self, path, timeout_s=60):
        end = time.time() + timeout_s
        while True:
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(os.path.relpath(path))
                break
            except OSError:
                if time.time() > end:
                    raise
                time.sleep(0.05)
        self.bytes = b""
        self.hello, self.channels, self.messages, self.answers, self.lost = None, {}, {}, {}, 0
        self.ended = False

    def send(self, kind, content):
        data = json.dumps(content).encode()
        self.socket.sendall(struct.pack("<IB", len(data), kind) + data)

    def subscribe(self, *topics):
        self.send(65, {"channels": [i for i, c in self.channels.items() if not topics or c["topic"] in topics]})

    def command(self, number, word, note=""):
        self.send(66, {"id": number, "command": word, "note": note})

    def read(self, seconds):
        end = time.time() + seconds
        while not self.ended and (left := end - time.time()) > 0:
            if not select.select([self.socket], [], [], left)[0]:
                break
            try:
                got = self.socket.recv(1 << 20)
            except ConnectionResetError:
                got = b""
            if not got:
                self.ended = True
            self.bytes += got
            while len(self.bytes) >= 5:
                size, kind = struct.unpack_from("<IB", self.bytes)
                if len(self.bytes) < 5 + size:
                    break
                self.take(kind, self.bytes[5 : 5 + size])
                self.bytes = self.bytes[5 + size :]
        return self

    def take(self, kind, content):
        if kind == 1:
            assert self.hello is None, "one hello"
            self.hello = json.loads(content)
        elif kind == 2:
            channel = json.loads(content)
            self.channels[channel["id"]] = channel
        elif kind == 3:
            number, ns = struct.unpack_from("<IQ", content)
            topic = self.channels[number]["topic"]
            data = content[12:]
            self.messages.setdefault(topic, []).append((ns, json.loads(data) if self.channels[number]["encoding"] == "json" else data))
        elif kind == 4:
            answer = json.loads(content)
            self.answers[answer["id"]] = answer["error"]
        elif kind == 5:
            self.lost = json.loads(content)["messages"]
        else:
            raise AssertionError(f"frame of the unknown kind {kind}")

    def until(self, ready, seconds=30):
        end = time.time() + seconds
        while not ready(self) and not self.ended and time.time() < end:
            self.read(0.1)
        return ready(self)
