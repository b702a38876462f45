"""Marks a capture in the moment in which its feed appears, before its readers run: nothing of it may be lost."""
import json
import signal
import subprocess
import sys
import time

from feed_listener import Feed

hueline = sys.argv[1]
with open("early.yaml", "w") as rig:
    rig.write("rig: nothing answers\nsensors:\n  - {name: pos, driver: novatel, tcp: {host: 127.0.0.1, port: 49999}}\ncolouring: {method: lens}\n")
for turn in range(3):
    drive = f"early{turn}"
    with subprocess.Popen([hueline, "capture", "early.yaml", "--out", drive, "--seconds", "60", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as capture:
        end = time.time() + 60
        while True:  # as fast as it can
            try:
                feed = Feed(drive + "/feed", timeout_s=0)
                break
            except OSError:
                assert time.time() < end, "the feed"
        feed.command(1, "mark", "at once")
        assert feed.until(lambda f: 1 in f.answers), "no answer"
        assert feed.answers[1] == "", feed.answers
        time.sleep(1)
        capture.send_signal(signal.SIGINT)
        capture.wait()
    with open(drive + "/summary.json") as summary:
        marks = [mark["note"] for mark in json.load(summary)["marks"]]
    assert marks == ["at once"], marks
