"""Listens to a replay."""
import sys

from feed_listener import Feed

feed = Feed(sys.argv[1] + "/feed")
assert feed.until(lambda f: any(c["topic"] == "/cloud" for c in f.channels.values())), feed.channels
assert feed.hello["mode"] == "replay", feed.hello
feed.subscribe()
assert feed.until(lambda f: f.messages.get("/cloud") and f.messages.get("/image/camera")), feed.messages.keys()
feed.command(1, "mark", "no")
assert feed.until(lambda f: 1 in f.answers) and "replay" in feed.answers[1], feed.answers
status = feed.messages["/hueline/status"][-1][1]
assert status["mode"] == "replay" and status["disk"] is None and all(s["state"] == "replay" for s in status["sensors"]), status
feed.until(lambda f: False, 200)
assert feed.ended
