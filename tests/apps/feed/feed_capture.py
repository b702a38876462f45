"""Listens to a capture: what comes, what commands do, and what a listener that never reads costs."""
import sys

from feed_listener import Feed

feed = Feed(sys.argv[1] + "/feed")
asleep = Feed(sys.argv[1] + "/feed")
wanted = {"/hueline/status", "/hueline/events", "/hueline/map", "/diagnostics"}
assert feed.until(lambda f: wanted <= {c["topic"] for c in f.channels.values()}), feed.channels
assert feed.hello["protocol"] == "hueline.feed.1" and feed.hello["mode"] == "capture" and feed.hello["drive"] == "drive", feed.hello
feed.subscribe("/hueline/status")
assert feed.until(lambda f: len(f.messages.get("/hueline/status", [])) > 3)
feed.command(1, "mark", "first")
feed.command(2, "segment")
feed.command(3, "mark", "x" * 501)
feed.command(4, "mark", "two\nlines")
feed.command(5, "dance")
assert feed.until(lambda f: len(f.answers) == 5)
assert feed.answers[1] == "", feed.answers
assert "segments" in feed.answers[2] and "500" in feed.answers[3] and "control" in feed.answers[4] and "mark" in feed.answers[5], feed.answers

# From the first good solution on there are the view's messages.
view = {"/cloud", "/pose", "/tf", "/tf_static", "/fix", "/log", "/health"}
assert feed.until(lambda f: view <= {c["topic"] for c in f.channels.values()}), feed.channels
asleep.until(lambda f: view <= {c["topic"] for c in f.channels.values()})
for one in (feed, asleep):
    one.subscribe()
moving = lambda f: any(m["pos"] and m["pos"]["speed_m_s"] > 1 for _, m in f.messages.get("/hueline/status", []))
assert feed.until(moving), "the vehicle moves"
feed.command(6, "mark", "bump \u2713 \u8def\u53e3")
assert feed.until(lambda f: 6 in f.answers) and feed.answers[6] == ""
assert feed.until(lambda f: f.messages.get("/cloud") and f.messages.get("/image/camera")), feed.messages.keys()
assert feed.until(lambda f: len(f.messages["/hueline/status"][-1][1]["marks"]) == 2)
status = feed.messages["/hueline/status"][-1][1]
assert {s["name"]: s["role"] for s in status["sensors"]}.items() >= {"pps": "pps", "pos": "pos", "laser": "scanner", "camera": "camera"}.items(), status
assert any(all(s["state"] == "running" and s["packets"] > 0 and s["rate_hz"] > 0 and s["age_s"] < 5 for s in m["sensors"]) for _, m in feed.messages["/hueline/status"]), status
assert status["disk"]["free_bytes"] > 0 and status["path_m"] > 0 and status["points"] > 0, status
assert [q["name"] for q in status["queues"]] == ["record", "pipeline"] and all(0 <= q["share"] < 1 for q in status["queues"]), status
events = [m for _, m in feed.messages["/hueline/events"]]
assert [e["text"] for e in events if e["kind"] == "mark"] == ["first", "bump \u2713 \u8def\u53e3"], events
assert feed.messages["/tf_static"] and feed.messages["/camera/lens0"], feed.messages.keys()
feed.until(lambda f: False, 2)
rows = {row[0]: row for _, m in feed.messages["/hueline/map"] for row in m["seconds"]}
assert any(row[3] > 0 for row in rows.values()), "seconds of the map with points"
# The stop ends the drive; asked twice, it does not cut it off.
feed.command(7, "stop")
feed.command(8, "stop")
feed.until(lambda f: False, 200)
assert feed.ended and feed.answers[7] == feed.answers[8] == "", feed.answers
# It has not read for seconds. What came then is the newest.
asleep.until(lambda f: False, 5)
assert asleep.ended
print(feed.lost, asleep.lost, {topic: len(all) for topic, all in asleep.messages.items()})
assert len(asleep.messages["/hueline/status"]) < len(feed.messages["/hueline/status"])
