#!/usr/bin/env python3
"""The console as a browser and as an attacker use it: login, roles, CSRF, a drive of emulated devices, and what must be refused.
usage: server_test.py CONSOLE HUELINE SOURCE_DIR"""
import contextlib
import http.client
import json
import os
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse

from websocket_client import WebSocket

console, hueline, source = sys.argv[1:4]
work = tempfile.mkdtemp()
users = work + "/users.json"
page = work + "/page"
played = work + "/played.raw"  # what the sound device has played
os.makedirs(page + "/assets")
open(page + "/index.html", "w").write("<!doctype html><title>page</title>")
open(page + "/assets/a-1.js", "w").write("1")
open(work + "/secret.json", "w").write("secret")
shutil.copytree(source + "/config/rigs", work + "/rigs")
os.makedirs(work + "/scenarios")
short = open(source + "/tests/scenarios/short.yaml").read()
open(work + "/scenarios/short.yaml", "w").write(re.sub("(?m)^duration_s: .*", "duration_s: 25", short))  # the console restarts meanwhile
open(work + "/scenarios/long.yaml", "w").write(re.sub("(?m)^duration_s: .*", "duration_s: 45", short))
environment = dict(os.environ, XDG_CONFIG_HOME=work + "/config")


class Console:
    def __init__(self, *words, port=0):
        self.process = subprocess.Popen(
            [console, "serve", "--drives", work + "/drives", "--rigs", work + "/rigs", "--page", page, "--users", users, "--port", str(port),
             "--hueline", hueline, "--allow-simulate", work + "/scenarios", "--sound", f"file:'| cat >> {played}',raw", *words],
            stderr=subprocess.PIPE, env=environment, text=True)
        self.said = ""
        while "the console is at" not in self.said:
            line = self.process.stderr.readline()
            assert line, self.said
            self.said += line
        self.port = int(re.search(r":(\d+)/;", self.said)[1])
        os.set_blocking(self.process.stderr.fileno(), False)
        self.cookie = self.csrf = None

    def ask(self, method, path, body=None, headers=None, csrf=True):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        all_headers = {}
        if method == "POST":
            all_headers["Content-Type"] = "application/json"
            if csrf and self.csrf:
                all_headers["X-Csrf"] = self.csrf
        if self.cookie:
            all_headers["Cookie"] = self.cookie
        all_headers.update(headers or {})
        connection.request(method, path, None if body is None else body if isinstance(body, bytes) else json.dumps(body), all_headers)
        answer = connection.getresponse()
        data = answer.read()
        self.headers = answer.headers
        if answer.headers["Content-Type"] == "application/json" and answer.status != 204:
            data = json.loads(data)
            if answer.status >= 400:
                assert data["error"], path
        return answer.status, data

    def log_in(self, name, password):
        self.cookie = self.csrf = None
        status, data = self.ask("POST", "/api/login", {"name": name, "password": password})
        if status == 200:
            self.cookie = self.headers["Set-Cookie"].split(";")[0]
            self.csrf = data["csrf"]
        return status, data

    def until(self, state, seconds=60):
        end = time.time() + seconds
        while time.time() < end:
            now = self.ask("GET", "/api/state")[1]
            if now["state"] == state:
                return now
            time.sleep(0.1)
        raise AssertionError((state, now))


class RefusingDrive:
    """Plays the feed of a drive: it refuses the first command, takes the second, shows the troubles that it is told, and ends when it is told."""

    def __init__(self, folder):
        os.makedirs(folder)
        self.path = folder + "/feed"
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.bind(self.path)
        self.socket.listen()
        self.links = []
        self.errors = ["the disk is too slow", ""]
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        while True:
            try:
                link = self.socket.accept()[0]
            except OSError:
                return
            self.links.append(link)
            self.send(link, 1, {"protocol": "hueline.feed.1", "mode": "capture", "rig": "street", "drive": "stubborn", "since": "", "pid": os.getpid()})
            self.send(link, 2, {"id": 0, "topic": "/hueline/status", "encoding": "json", "schema_name": "hueline.Status", "schema_encoding": "jsonschema", "schema": "{}"})
            threading.Thread(target=self.answer, args=[link], daemon=True).start()

    def send(self, link, kind, json_value, before=b""):
        content = before + json.dumps(json_value).encode()
        link.sendall(struct.pack("<IB", len(content), kind) + content)

    def show(self, *troubles):
        status = {"drive": "stubborn", "level": "ok", "troubles": [], "sensors": [{"name": "laser", "troubles": troubles}]}
        for link in self.links:
            self.send(link, 3, status, struct.pack("<Iq", 0, time.time_ns()))

    def answer(self, link):
        stream = link.makefile("rb")
        while header := stream.read(5):
            size, kind = struct.unpack("<IB", header)
            content = json.loads(stream.read(size))
            if kind == 66:
                self.send(link, 4, {"id": content["id"], "error": self.errors.pop(0)})

    def end(self, killed=False):
        self.socket.shutdown(socket.SHUT_RDWR)  # or it would be open until the next accept() returns
        self.socket.close()
        if not killed:
            os.unlink(self.path)
        for link in self.links:
            link.shutdown(socket.SHUT_RDWR)


def until(is_so, seconds, what):
    end = time.time() + seconds
    while not is_so():
        assert time.time() < end, what + ": not so"
        time.sleep(0.05)


def sounds():
    """How many seconds of sound have been played since the last call, when one has ended."""
    size = -1
    while size != os.path.getsize(played):
        size = os.path.getsize(played)
        time.sleep(0.3)
    os.truncate(played, 0)
    return size / 2 / 48000


def add_user(name, role, password):
    subprocess.run([console, "user", "add", name, "--role", role, "--users", users], input=password + "\n", text=True, check=True, stdout=subprocess.DEVNULL)


def programs_with(word):
    """The programs that were started with this among their words."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            if word.encode() in open(f"/proc/{pid}/cmdline", "rb").read():
                found.append(int(pid))
        except OSError:
            pass  # it has ended
    return found


def connections_of(process):
    return len([f for f in os.listdir(f"/proc/{process.pid}/fd") if os.path.islink(f"/proc/{process.pid}/fd/{f}")])


running = []
try:
    # Nobody can log in before there is a user, and there is no password that works anyway.
    server = Console("--plain")
    running.append(server)
    assert "user add" in server.said
    assert server.ask("GET", "/api/session")[0] == 503
    assert server.log_in("admin", "admin")[0] == 503
    add_user("anna", "operator", "correct horse")
    add_user("vera", "viewer", "battery staple")
    assert subprocess.run([console, "user", "add", "x", "--users", users], input="short\n", text=True, capture_output=True).returncode == 2

    # The page, and nothing beside it.
    status, data = server.ask("GET", "/")
    assert status == 200 and b"<title>page" in data
    csp = server.headers["Content-Security-Policy"]
    assert "default-src 'none'" in csp and "unsafe" not in csp, csp
    assert server.headers["X-Content-Type-Options"] == "nosniff" and server.headers["Cache-Control"] == "no-cache"
    assert server.ask("GET", "/assets/a-1.js")[0] == 200 and "immutable" in server.headers["Cache-Control"]
    for path in ("/../secret.json", "/assets/../../secret.json", "/%2e%2e/secret.json", "//etc/passwd", "/assets//a-1.js", "/.hidden", "/assets"):
        assert server.ask("GET", path)[0] == 404, path

    # Login, roles, CSRF, Origin.
    assert server.ask("GET", "/api/state")[0] == 401
    assert server.log_in("anna", "wrong password")[0] == 401
    status, data = server.log_in("vera", "battery staple")
    assert status == 200 and data["role"] == "viewer", data
    cookie = server.headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie, cookie
    assert server.ask("GET", "/api/state")[1]["state"] == "idle"
    assert server.ask("POST", "/api/stop", {})[0] == 403
    assert server.log_in("anna", "correct horse")[0] == 200
    assert server.ask("POST", "/api/stop", {}, csrf=False)[0] == 403
    assert server.ask("POST", "/api/stop", {}, {"Origin": "http://evil.example"})[0] == 403
    assert server.ask("POST", "/api/stop", {}, {"Origin": f"http://127.0.0.1:{server.port}"})[0] == 409
    assert server.ask("POST", "/api/stop", {}, {"Content-Type": "text/plain"})[0] == 415
    assert server.ask("POST", "/api/stop", b"[]")[0] == 400
    assert server.ask("POST", "/api/stop", b'{"a":\xff}')[0] == 400
    assert server.ask("DELETE", "/api/state")[0] == 405
    assert server.ask("GET", "/api/nothing")[0] == 404
    assert server.ask("POST", "/api/start", {"rig": "../../etc/passwd"})[0] == 400
    assert server.ask("POST", "/api/start", {"rig": "street", "name": "../x"})[0] == 400
    assert server.ask("POST", "/api/start", {"rig": "street", "simulate": "../short"})[0] == 400
    assert server.ask("POST", "/api/replay", {"drive": "none"})[0] == 409
    assert server.ask("GET", "/api/drives/../summary.json")[0] in (400, 404)
    assert server.ask("GET", "/api/drives/x/drive.mcap")[0] == 404
    assert server.ask("POST", "/api/mark", {"note": "x"})[0] == 409
    assert "street" in [r["name"] for r in server.ask("GET", "/api/rigs")[1]["rigs"]]
    # A drive from the command line may have any name.
    named = work + '/drives/Stra\u00dfe "1" <b>'
    os.makedirs(named)
    open(named + "/drive.mcap", "w").write("x")
    open(named + "/summary.json", "w").write("{}")
    listed = server.ask("GET", "/api/drives")[1]
    assert [one["name"] for one in listed["drives"]] == [os.path.basename(named)] and listed["all"] == 1, listed
    assert server.ask("GET", f"/api/drives/{urllib.parse.quote(os.path.basename(named))}/summary.json") == (200, {})
    assert server.ask("GET", "/api/drives/%2e%2e/summary.json")[0] == 400
    shutil.rmtree(named)

    # Who is removed, or gets another password, is logged out.
    anna = server.cookie, server.csrf
    remove = [console, "user", "remove", "carl", "--users", users]
    for change in (lambda: add_user("carl", "operator", "battery staple"), lambda: subprocess.run(remove, check=True, stdout=subprocess.DEVNULL)):
        add_user("carl", "operator", "correct horse")
        assert server.log_in("carl", "correct horse")[0] == 200
        assert server.ask("GET", "/api/state")[0] == 200
        open_page = WebSocket(server.port, Cookie=server.cookie)
        change()
        assert server.ask("GET", "/api/state")[0] == 401
        open_page.read(5)
        assert open_page.closed, "a WebSocket of somebody who is logged out"
    server.cookie, server.csrf = anna
    assert server.ask("GET", "/api/state")[0] == 200
    assert subprocess.run(remove, capture_output=True).returncode == 2
    listed = subprocess.run([console, "user", "list", "--users", users], text=True, capture_output=True).stdout.split()
    assert listed == ["anna", "operator", "vera", "viewer"], listed

    # A drive that refuses to stop goes on, says why, and is asked again.
    drive = RefusingDrive(work + "/drives/stubborn")
    server.until("driving", 10)
    status, data = server.ask("POST", "/api/stop", {})
    assert status == 409 and data["error"] == "the disk is too slow", (status, data)
    assert server.ask("GET", "/api/state")[1]["state"] == "driving"
    # An alarm sounds until it is acknowledged. A drive that ends as it was asked to makes no sound.
    gone = {"trouble": "gone", "level": "alarm", "cause": "sends nothing", "action": "check its cable"}
    alarm_s = 3 * 0.18
    open(played, "a").close()
    time.sleep(2.5)
    assert sounds() == 0, "a drive that has sent no status yet is no silent one"
    drive.show(gone)
    until(lambda: sounds() >= alarm_s, 10, "the alarm is heard")
    until(lambda: sounds() >= alarm_s, 10, "the alarm is heard again")
    assert server.ask("POST", "/api/acknowledge", {"alarm": "laser gone alarm"})[0] == 200
    assert server.ask("GET", "/api/state")[1]["acknowledged"] == ["laser gone alarm"]
    sounds()
    for _ in range(40):  # a drive that says nothing for 2 s would be an alarm, too
        drive.show(gone)
        time.sleep(0.1)
    assert sounds() == 0, "the acknowledged alarm is heard"
    until(lambda: sounds() >= alarm_s, 20, "the silence of the drive is heard")
    drive.show()
    until(lambda: server.ask("GET", "/api/state")[1]["acknowledged"] == [], 5, "the alarm is over")
    assert server.ask("POST", "/api/sound", {})[0] == 202
    until(lambda: sounds() >= alarm_s, 10, "the alarm is heard for trial")
    assert server.ask("POST", "/api/stop", {})[0] == 202
    drive.end()
    server.until("idle", 10)
    assert server.ask("GET", "/api/state")[1]["ended"] is False
    # One that is killed leaves its socket behind.
    drive = RefusingDrive(work + "/drives/killed")
    server.until("driving", 10)
    drive.end(killed=True)
    server.until("idle", 10)
    assert server.ask("GET", "/api/state")[1]["ended"] is True
    until(lambda: sounds() >= alarm_s, 10, "the end of the drive is heard")
    assert server.ask("POST", "/api/acknowledge", {"alarm": "console ended"})[0] == 200
    assert server.ask("GET", "/api/state")[1]["ended"] is False
    os.unlink(drive.path)

    # What is too large, too slow, or no HTTP.
    assert server.ask("POST", "/api/mark", {"note": "x" * 70000})[0] == 413
    assert server.ask("GET", "/", headers={"X-Large": "x" * 20000})[0] == 431
    slow = socket.create_connection(("127.0.0.1", server.port))
    slow.sendall(b"GET / HTTP/1.1\r\n")
    garbage = socket.create_connection(("127.0.0.1", server.port))
    garbage.sendall(b"\x16\x03\x01\x02\x00\x01\x00\n\n\n\n")
    garbage.settimeout(15)
    assert b"400" in garbage.recv(1000) or True
    began = time.time()
    slow.settimeout(20)
    ended = False
    while time.time() - began < 15 and not ended:
        try:
            slow.sendall(b"X-A: b\r\n")  # a byte now and then gives no more time
        except OSError:
            ended = True
            break
        ended = bool(select.select([slow], [], [], 0.5)[0]) and slow.recv(100) == b""
    assert ended and 8 < time.time() - began < 14, time.time() - began

    # A flood of connections is turned away; who is there stays.
    flood = []
    for _ in range(400):
        try:
            flood.append(socket.create_connection(("127.0.0.1", server.port), 5))
        except OSError:
            break
    time.sleep(0.5)
    assert connections_of(server.process) < 300, connections_of(server.process)
    for one in flood:
        one.close()
    time.sleep(0.5)
    assert server.ask("GET", "/api/state")[0] == 200

    # WebSockets: only who may, only known protocols.
    assert WebSocket(server.port).status == 401
    own = {"Cookie": server.cookie}
    assert WebSocket(server.port, Origin="http://evil.example", **own).status == 403
    assert WebSocket(server.port, protocols="chat", **own).status == 400
    assert WebSocket(server.port, path="/?token=" + "0" * 64).status == 401
    token = subprocess.run([console, "user", "token", "vera", "--users", users], text=True, check=True, capture_output=True).stdout.strip()
    both = [WebSocket(server.port, path="/?token=" + token, protocols="foxglove.sdk.v1"), WebSocket(server.port, protocols="foxglove.websocket.v1, foxglove.sdk.v1", **own)]
    assert [one.protocol for one in both] == ["foxglove.sdk.v1", "foxglove.websocket.v1"], [one.status for one in both]
    for one in both:
        one.until(lambda: "/hueline/console" in one.topics)
        assert one.ops[0]["op"] == "serverInfo", one.ops
        one.subscribe("/hueline/console")
        one.until(lambda: one.messages.get("/hueline/console"))
    big = WebSocket(server.port, **own)
    big.send(b"x" * 70000)
    big.read(3)
    assert big.closed, "a message of 70 kB"
    bad = WebSocket(server.port, **own)
    bad.send(b'{"op":"\xff"}')
    bad.read(3)
    assert bad.closed, "text that is no UTF-8"
    deep = WebSocket(server.port, **own)
    deep.send(b"[" * 60000)
    deep.op(op="dance")
    deep.until(lambda: any(m["op"] == "status" for m in deep.ops))

    # A rig that is wrong: the page says so by the exit status.
    open(work + "/rigs/wrong.yaml", "w").write("rig: wrong\nsensors: none\n")
    assert server.ask("GET", "/api/check")[1]["exit_status"] is None
    assert server.ask("POST", "/api/check", {"rig": "wrong"})[0] == 202
    for _ in range(100):
        found = server.ask("GET", "/api/check")[1]
        if found["state"] != "running":
            break
        time.sleep(0.1)
    assert found["state"] == "failed" and found["exit_status"] == 2 and "wrong.yaml" in found["error"], found

    # A drive of emulated devices.
    status, data = server.ask("POST", "/api/start", {"rig": "street", "simulate": "short", "name": "first", "override": "no time"})
    assert status == 202 and data["drive"] == "first", data
    assert server.ask("POST", "/api/start", {"rig": "street"})[0] == 409
    state = server.until("driving", 90)
    assert state["drive"] == "first" and state["rig"], state
    for one in both:
        one.until(lambda: "/hueline/status" in one.topics)
        one.subscribe("/hueline/status", "/hueline/events")
        one.until(lambda: one.messages.get("/hueline/status") and one.messages.get("/hueline/events"))
    # The console is killed; the drive goes on, and the next console finds it.
    stuck = WebSocket(server.port, **own)
    stuck.until(lambda: "/hueline/status" in stuck.topics)
    server.process.kill()
    server.process.wait()
    server = Console("--plain", port=server.port)  # which the drive has not kept
    running.append(server)
    assert server.log_in("anna", "correct horse")[0] == 200
    assert server.until("driving", 5)["drive"] == "first"
    watcher = WebSocket(server.port, Cookie=server.cookie)
    sleeper = WebSocket(server.port, Cookie=server.cookie)  # never reads
    for one in (watcher, sleeper):
        # Each is advertised when the drive's feed begins it, so one may be known before another.
        one.until(lambda: {"/cloud", "/image/camera", "/tf_static"} <= one.topics.keys(), 60)
        one.subscribe(*one.topics)
    status, data = server.ask("POST", "/api/mark", {"note": "bump \u2713"})
    assert status == 200, data
    watcher.until(lambda: any(m["text"] == "bump \u2713" for m in watcher.messages.get("/hueline/events", [])))
    watcher.until(lambda: watcher.messages.get("/cloud") and watcher.messages.get("/image/camera") and watcher.messages.get("/tf_static"))
    assert server.ask("POST", "/api/stop", {})[0] == 202
    # It stops within its own time. What it says at its end is no child of this console.
    watcher.until(lambda: any(m["op"] == "unadvertise" for m in watcher.ops), 60)
    server.until("idle", 60)
    for _ in range(100):
        if os.path.exists(work + "/drives/first/summary.json") and os.path.getsize(work + "/drives/first/summary.json") > 100:
            break
        time.sleep(0.2)
    status, summary = server.ask("GET", "/api/drives/first/summary.json")
    assert status == 200 and [m["note"] for m in summary["marks"]] == ["started although the check said not ready: no time", "bump \u2713"], summary.get("marks")
    status, report = server.ask("GET", "/api/drives/first/report.html")
    assert status == 200 and b"bump" in report and "sandbox" in server.headers["Content-Security-Policy"]
    status, report = server.ask("GET", "/api/drives/first/report.pdf")
    assert status == 200 and report == open(work + "/drives/first/report.pdf", "rb").read() and report.startswith(b"%PDF-"), status
    assert server.headers["Content-Type"] == "application/pdf", server.headers
    drives = server.ask("GET", "/api/drives")[1]["drives"]
    assert drives[0]["name"] == "first" and drives[0]["bytes"] > 1e5 and drives[0]["grade"], drives
    # The same bytes as a replay makes without anybody.
    subprocess.run([hueline, "replay", work + "/drives/first", "--out", work + "/alone", "--no-feed"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for file in ("cloud.las", "view.mcap", "report.html", "report.pdf"):
        assert open(f"{work}/drives/first/{file}", "rb").read() == open(f"{work}/alone/{file}", "rb").read(), file

    # A replay is shown in the same way.
    assert server.ask("POST", "/api/replay", {"drive": "first", "speed": 1})[0] == 202
    server.until("replaying", 30)
    assert server.ask("POST", "/api/stop", {})[0] == 202
    server.until("idle", 30)

    # The emulated devices of the console that was killed would speak to this drive too.
    for _ in range(600):
        if not programs_with(work + "/drives/.console/sim-"):
            break
        time.sleep(0.1)
    else:
        raise AssertionError("the emulated devices of the drive before do not end")
    # It is paused, goes on faster, and goes on elsewhere.
    assert server.ask("POST", "/api/start", {"rig": "street", "simulate": "long", "name": "long"})[0] == 202
    server.until("driving", 90)
    server.until("idle", 120)
    subprocess.run([hueline, "cut", work + "/drives/long", "--from", "15", "--out", work + "/part.mcap"], check=True, stdout=subprocess.DEVNULL)
    for words in (["part.mcap", "--out", work + "/of-cut"], ["drives/long", "--from", "35", "--out", work + "/of-replay"]):
        subprocess.run([hueline, "replay", work + "/" + words[0], *words[1:], "--no-feed"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for file in ("cloud.las", "view.mcap"):
        assert open(f"{work}/of-cut/{file}", "rb").read() == open(f"{work}/of-replay/{file}", "rb").read(), file
    assert os.path.getsize(work + "/of-cut/cloud.las") > 1e5
    beyond = subprocess.run([hueline, "replay", work + "/drives/long", "--from", "3000", "--out", work + "/beyond", "--no-feed"], text=True, capture_output=True)
    assert beyond.returncode == 2 and "give a smaller one" in beyond.stderr, beyond

    for call, body in (("pace", {"paused": True}), ("seek", {"position_s": 3})):
        assert server.ask("POST", "/api/replay/" + call, body)[0] == 409, call
    assert server.ask("POST", "/api/replay", {"drive": "long", "speed": 1})[0] == 202
    server.until("replaying", 30)
    watcher = WebSocket(server.port, Cookie=server.cookie)
    watcher.until(lambda: "/hueline/status" in watcher.topics)
    watcher.subscribe("/hueline/status")

    def newest():
        watcher.messages.pop("/hueline/status", None)
        watcher.until(lambda: watcher.messages.get("/hueline/status"))
        return watcher.messages["/hueline/status"][-1]

    def reach(position_s, seconds=30):
        end = time.time() + seconds
        while newest()["replay"]["position_s"] < position_s:
            assert time.time() < end, newest()["replay"]

    reach(2)
    for wrong in ({}, {"paused": "yes"}, {"speed": "fast"}):
        assert server.ask("POST", "/api/replay/pace", wrong)[0] == 400, wrong
    assert server.ask("POST", "/api/replay/seek", {})[0] == 400
    assert server.ask("POST", "/api/replay/pace", {"paused": True})[0] == 200
    state = server.until("paused", 5)
    assert state["replay"]["speed"] == 1 and 40 < state["replay"]["duration_s"] < 80, state
    time.sleep(0.5)
    before = newest()["replay"]
    time.sleep(1.5)
    after = newest()["replay"]
    assert before["paused"] and after["position_s"] == before["position_s"], (before, after)
    assert server.ask("POST", "/api/replay/pace", {"paused": False, "speed": 4})[0] == 200
    server.until("replaying", 5)
    began = time.time()
    reach(before["position_s"] + 6)
    assert 1 < time.time() - began < 4, time.time() - began
    # Elsewhere, with a time before it in which the clocks lock, and without what lies before that.
    began = time.time()
    watcher.topics.clear()
    assert server.ask("POST", "/api/replay/seek", {"position_s": 35})[0] == 202
    assert server.ask("GET", "/api/state")[1]["state"] == "starting"
    state = server.until("replaying", 30)
    assert state["drive"] == "long" and state["replay"]["from_s"] == 35 and state["replay"]["speed"] == 4, state
    watcher.until(lambda: "/hueline/status" in watcher.topics and "/cloud" in watcher.topics, 30)
    watcher.messages.clear()
    watcher.subscribe("/hueline/status", "/cloud", "/hueline/map")
    watcher.until(lambda: watcher.messages.get("/cloud") and watcher.messages.get("/hueline/map"), 30)
    reach(36)
    now = newest()
    assert now["clocks"][0]["state"] == "Locked" and now["points"] > 1000 and now["drive_s"] > 30, now
    assert watcher.messages["/hueline/map"][0]["first_s"] >= 15, watcher.messages["/hueline/map"][0]
    print(f"another second after {time.time() - began:.1f} s")
    # Paused it goes elsewhere too, and back.
    assert server.ask("POST", "/api/replay/pace", {"paused": True})[0] == 200
    assert server.ask("POST", "/api/replay/seek", {"position_s": 5})[0] == 202
    state = server.until("paused", 30)
    assert state["replay"]["from_s"] == 5, state
    time.sleep(2)
    watcher = WebSocket(server.port, Cookie=server.cookie)
    watcher.until(lambda: "/hueline/status" in watcher.topics)
    watcher.subscribe("/hueline/status")
    assert 5 <= newest()["replay"]["position_s"] < 7, newest()["replay"]
    # The console is killed; the next one finds the replay with its time line.
    server.process.kill()
    server.process.wait()
    server = Console("--plain", port=server.port)
    running.append(server)
    assert server.log_in("anna", "correct horse")[0] == 200
    state = server.until("paused", 5)
    assert state["replay"]["from_s"] == 5 and state["replay"]["duration_s"] > 40, state
    assert server.ask("POST", "/api/replay/seek", {"position_s": 20})[0] == 202
    assert server.until("paused", 30)["replay"]["from_s"] == 20
    assert server.ask("POST", "/api/stop", {})[0] == 202
    assert server.until("idle", 30)["replay"] is None

    # Wrong passwords are limited, also for who knows the right one now.
    codes = [server.log_in("anna", f"wrong {i}")[0] for i in range(7)]
    assert codes == [401] * 5 + [429] * 2 and int(server.headers["Retry-After"]) > 0, codes
    assert server.log_in("anna", "correct horse")[0] == 429

    # TLS with a certificate made on first use, which is kept.
    secure = Console()
    running.append(secure)
    first = re.search("SHA-256 is (\\S+)", secure.said)[1]
    out = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{secure.port}"], input="", text=True, capture_output=True).stdout
    assert "TLSv1.3" in out, out
    assert os.stat(work + "/config/hueline/console-key.pem").st_mode & 0o777 == 0o600
    secure.process.terminate()
    secure.process.wait(10)
    again = Console()
    running.append(again)
    assert re.search("SHA-256 is (\\S+)", again.said)[1] == first
    refused = subprocess.run([console, "serve", "--drives", work + "/drives", "--plain", "--address", "0.0.0.0"], text=True, capture_output=True, env=environment)
    assert refused.returncode == 2 and "--plain" in refused.stderr, refused
    for words, said in ((["--rigs", work + "/nowhere"], "--rigs .*no such folder"), (["--address", "192.0.2.1"], "no such address"),
                        (["--port", str(server.port)], "does a console run already"), (["--prot", "1"], "^hueline-console serve: unknown option")):
        refused = subprocess.run([console, "serve", "--drives", work + "/drives", "--sound", "none", *words], text=True, capture_output=True, env=environment)
        assert refused.returncode in (2, 4) and re.search(said, refused.stderr), refused
    print("login, drive, kill, replay, TLS: as they should be")
finally:
    for one in running:
        one.process.kill()
    # The emulated devices of the console that was killed would keep their ports until their drive ends.
    for pid in programs_with(work):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    shutil.rmtree(work, ignore_errors=True)
