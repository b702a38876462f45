#!/usr/bin/env python3
"""Two drives of the same emulated devices: one alone, and one whose console is flooded, stopped and killed. Prints what the capture computed, shed
and lost in each, and fails if anything was lost or if a replay gives other bytes than the live run.
usage: load_proof.py CONSOLE HUELINE SOURCE_DIR [SECONDS]
The figures are in docs/performance.md."""
import http.client
import json
import os
import re
import resource
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from websocket_client import WebSocket

console, hueline, source = sys.argv[1:4]
seconds = int(sys.argv[4]) if len(sys.argv) > 4 else 40
SLOW_CLIENTS, CONNECTIONS = 100, 10_000
work = tempfile.mkdtemp()
ports = ["--pps-socket", work + "/pps.sock", "--data-port", "42378", "--position-port", "48318", "--pos-port", "43011", "--can-port", "40010", "--address", "127.0.0.4"]
running = []
failures = []


def start(*words, **more):
    running.append(subprocess.Popen(words, stdin=subprocess.DEVNULL, text=True, **more))
    return running[-1]


class Serving:
    """A console that shows the drives, with an operator who is logged in."""

    def __init__(self):
        self.process = start(console, "serve", "--drives", work + "/drives", "--rigs", work, "--users", work + "/users.json", "--port", "0", "--hueline", hueline,
                             "--plain", stderr=subprocess.PIPE)
        said = ""
        while "the console is at" not in said:
            line = self.process.stderr.readline()
            assert line, said
            said += line
        os.set_blocking(self.process.stderr.fileno(), False)
        self.port = int(re.search(r":(\d+)/;", said)[1])
        link = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        link.request("POST", "/api/login", json.dumps({"name": "anna", "password": "correct horse"}), {"Content-Type": "application/json"})
        answer = link.getresponse()
        answer.read()
        self.cookie = answer.headers["Set-Cookie"].split(";")[0]

    def watch(self):
        return WebSocket(self.port, Cookie=self.cookie)

    def memory_mb(self):
        return int(re.search(r"VmRSS:\s+(\d+)", open(f"/proc/{self.process.pid}/status").read())[1]) / 1000


def disturb(end):
    """Floods, stops and kills consoles until the time `end`. Says what was done."""
    done = {}
    server = Serving()
    clients = []
    for _ in range(SLOW_CLIENTS):
        clients.append(server.watch())
    for one in clients:
        one.until(lambda: len(one.topics) > 5, 60)
        one.subscribe(*one.topics)  # and never reads again
    done["slow clients, subscribed to everything"] = len(clients)
    before = server.memory_mb()
    time.sleep(5)
    done["console's memory with them, MB"] = f"{before:.0f} -> {server.memory_mb():.0f}"
    server.process.send_signal(signal.SIGSTOP)
    time.sleep(4)
    server.process.send_signal(signal.SIGCONT)
    done["console stopped for"] = "4 s"
    flood = []
    refused = 0
    for _ in range(CONNECTIONS):
        try:
            flood.append(socket.create_connection(("127.0.0.1", server.port), 5))
            flood[-1].sendall(b"GET / HTTP/1.1\r\n")
        except OSError:
            refused += 1
    done["connections, with half a request each"] = f"{len(flood)}, {refused} refused"
    ended = select.poll()
    for one in flood:
        ended.register(one, select.POLLIN)
    done["of these closed by the console"] = len(ended.poll(0))
    done["console's memory then, MB"] = f"{server.memory_mb():.0f}"
    done["console's open files then"] = len(os.listdir(f"/proc/{server.process.pid}/fd"))
    server.process.kill()
    server.process.wait()
    done["console killed"] = "once"
    server = Serving()
    watcher = server.watch()
    watcher.until(lambda: "/hueline/status" in watcher.topics, 20)
    watcher.subscribe("/hueline/status")
    begin, had = time.time(), len(watcher.messages.get("/hueline/status", []))
    watcher.read(max(1.0, end - time.time()))
    got = len(watcher.messages.get("/hueline/status", [])) - had
    done["statuses a second from the next console"] = f"{got / (time.time() - begin):.1f}"
    if got == 0:
        failures.append("the next console did not show the drive")
    for one in flood:
        one.close()
    return done


def drive(name, is_disturbed):
    folder = f"{work}/drives/{name}"
    devices = start(hueline, "simulate", work + "/scenario.yaml", "--out", work + "/sim", "--play", *ports, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    begin = time.time()
    capture = start(hueline, "capture", work + "/rig.yaml", "--out", folder, "--until-silent", "--seconds", "180", "--quiet", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not os.path.exists(folder + "/drive.mcap"):
        time.sleep(0.05)
        assert capture.poll() is None
    time.sleep(3)
    done = disturb(begin + seconds) if is_disturbed else {}
    _, status, usage = os.wait4(capture.pid, 0)
    capture.returncode = os.waitstatus_to_exitcode(status)
    devices.wait()
    summary = json.load(open(folder + "/summary.json"))
    proof = json.loads(subprocess.run([hueline, "verify", folder, "--json"], text=True, stdout=subprocess.PIPE).stdout)
    row = {
        "exit status": capture.returncode,
        "verdict": summary["verdict"]["grade"],
        "packets": proof["packets"],
        "refused": sum(one["refused"] for one in proof["sources"]),
        "shed": sum(one["not_fused"] for one in proof["sources"]),
        "lost in buffers": sum(one["lost_in_buffers"] for one in proof["sources"]),
        "points": summary["points"]["total"],
        "processor time, s": f"{usage.ru_utime + usage.ru_stime:.1f}",
        "memory, MB": f"{usage.ru_maxrss / 1000:.0f}",
    }
    if not proof["is_whole"] or row["refused"] or row["lost in buffers"]:
        failures.append(f"{name}: packets were lost")
    subprocess.run([hueline, "replay", folder, "--out", work + "/again", "--no-feed"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for file in ("cloud.las", "view.mcap", "report.html", "report.pdf"):
        if open(f"{folder}/{file}", "rb").read() != open(f"{work}/again/{file}", "rb").read():
            failures.append(f"{name}: {file} of the replay is not the live run's")
    shutil.rmtree(work + "/again")
    return row, done


try:
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, CONNECTIONS + 2000), hard))
    os.makedirs(work + "/drives")
    short = open(source + "/tests/scenarios/short.yaml").read()
    open(work + "/scenario.yaml", "w").write(re.sub("(?m)^duration_s: .*", f"duration_s: {seconds}", short))
    subprocess.run([hueline, "simulate", work + "/scenario.yaml", "--out", work + "/sim", "--write-rig", work + "/rig.yaml", *ports], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    subprocess.run([console, "user", "add", "anna", "--role", "operator", "--users", work + "/users.json"], input="correct horse\n", text=True, check=True,
                   stdout=subprocess.DEVNULL)
    alone, _ = drive("alone", False)
    disturbed, done = drive("disturbed", True)
    for what, value in done.items():
        print(f"{what:44} {value}")
    print(f"{'':20}{'alone':>12}{'disturbed':>12}")
    for what in alone:
        print(f"{what:20}{alone[what]!s:>12}{disturbed[what]!s:>12}")
    print("\n".join(failures) or "nothing was lost, and the replays give the same bytes")
    sys.exit(1 if failures else 0)
finally:
    for one in running:
        if one.poll() is None:
            one.kill()
    shutil.rmtree(work, ignore_errors=True)
