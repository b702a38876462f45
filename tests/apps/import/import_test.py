#!/usr/bin/env python3
"""A recording of ROS becomes a drive, and a replay places and colours its points where a made-up world has them.

The vehicle drives north at 5 m/s along a wall 8 m to its left, which is painted in stripes of 4 m, red and green. The recording has point
clouds whose points have times, images of a camera that looks left, in colours and grey, the camera's calibration, poses, and the tree of
frames; it also has a topic that nobody knows. The world is calculated here, with nothing of hueline.
usage: import_test.py HUELINE
"""
import math
import os
import resource
import sqlite3
import struct
import subprocess
import sys
import tempfile

hueline = os.path.abspath(sys.argv[1])
WALL, STRIPE, SPEED = 8.0, 4.0, 5.0
BEGIN = 1_700_000_000 * 10**9  # ns of UTC
POSES_S, CLOUDS_S = 16.0, 3.0
LATITUDE, LONGITUDE = 48.0, 9.0  # on the central meridian of UTM zone 32: north is north
SCALE, HEIGHT_M = 0.9996, 500.0  # of the map; of the drive above the ellipsoid
A, E2 = 6378137.0, 0.0066943799901413


def meridian_radius(degrees):
    return A * (1 - E2) / (1 - E2 * math.sin(math.radians(degrees)) ** 2) ** 1.5


def northing_of(degrees):
    """The map's northing on the central meridian, by Simpson's rule."""
    steps = 2000
    sum_ = sum((1 if k in (0, steps) else 4 if k % 2 else 2) * meridian_radius(degrees * k / steps) for k in range(steps + 1))
    return SCALE * sum_ * math.radians(degrees) / steps / 3


# A metre at the height of the drive is so much on the map.
ALONG = SCALE * meridian_radius(LATITUDE) / (meridian_radius(LATITUDE) + HEIGHT_M)
FOCAL, WIDTH, HEIGHT = 80.0, 160, 120  # px
SCANNER_UP, CAMERA_UP = 2.0, 1.5
RINGS, FIRINGS = 16, [step for step in range(360) if math.sin(2 * math.pi * step / 360) >= 0.3]  # to the left


class Cdr:
    """Writes a message as ROS 2 does."""

    def __init__(self):
        self.data = bytearray(b"\0\1\0\0")

    def put(self, code, *values):
        for value in values:
            while (len(self.data) - 4) % struct.calcsize(code):
                self.data.append(0)
            self.data += struct.pack("<" + code, value)
        return self

    def text(self, value):
        self.put("I", len(value) + 1)
        self.data += value.encode() + b"\0"
        return self

    def bytes(self, value):
        self.put("I", len(value))
        self.data += value
        return self

    def header(self, ns, frame):
        return self.put("i", ns // 10**9).put("I", ns % 10**9).text(frame)


def way(ns):
    """How far north of the begin the vehicle is, m."""
    return SPEED * (ns - BEGIN) / 1e9


def is_red(north):
    return math.floor(north / STRIPE) % 2 == 0


def pose(ns):
    gps = ns - 315964800 * 10**9 + 18 * 10**9
    week, ms = gps // (604800 * 10**9), gps // 10**6 % (604800 * 1000)
    out = Cdr().header(ns, "base_link").text("INSPVAX").put("H", 1465).put("B", 0).put("I", 0).put("B", 180)
    out.put("H", week).put("I", ms).put("I", 3).put("I", 56)
    out.put("d", LATITUDE + math.degrees(way(ns) / (meridian_radius(LATITUDE) + HEIGHT_M)), LONGITUDE, HEIGHT_M).put("f", 0.0)
    out.put("d", SPEED, 0, 0).put("d", 0, 0, 0).put("f", 0.02, 0.02, 0.03, 0.01, 0.01, 0.01, 0.01, 0.01, 0.05)
    return out.put("I", 0).put("H", 0).data


def odometry(ns):
    """The same as pose() by a simulator: metres from an origin, and no date."""
    half = math.sqrt(0.5)
    return Cdr().header(ns, "odom").text("base_link").put("d", 0, way(ns), 0).put("d", 0, 0, half, half).put("d", *[0] * 36).data


def lambert_93(latitude, longitude):
    """Easting and northing of the map EPSG:2154, a cone, and the heading of its north, rad (EPSG's guidance note 7-2)."""
    excentricity = math.sqrt(E2)

    def along(degrees):
        sine = math.sin(math.radians(degrees))
        return math.tan(math.pi / 4 - math.radians(degrees) / 2) / ((1 - excentricity * sine) / (1 + excentricity * sine)) ** (excentricity / 2)

    def across(degrees):
        return math.cos(math.radians(degrees)) / math.sqrt(1 - E2 * math.sin(math.radians(degrees)) ** 2)

    n = (math.log(across(49)) - math.log(across(44))) / (math.log(along(49)) - math.log(along(44)))
    scale = A * across(49) / (n * along(49) ** n)
    turn = n * math.radians(longitude - 3)
    return 700000 + scale * along(latitude) ** n * math.sin(turn), 6600000 + scale * (along(46.5) ** n - along(latitude) ** n * math.cos(turn)), turn


def map_odometry(ns):
    """The same as pose() in the coordinates of a map whose north is 4.4 degrees beside the way."""
    latitude = LATITUDE + math.degrees(way(ns) / (meridian_radius(LATITUDE) + HEIGHT_M))
    east, north, turn = lambert_93(latitude, LONGITUDE)
    yaw = math.pi / 2 + turn
    out = Cdr().header(ns, "map").text("base_link").put("d", east, north, HEIGHT_M)
    return out.put("d", 0, 0, math.sin(yaw / 2), math.cos(yaw / 2)).put("d", *[0] * 36).data


def cloud(ns):
    """A turn of 0.1 s, during which the vehicle drives on: each point is where the scanner sees it at its own time."""
    points, count = bytearray(), 0
    for step in FIRINGS:
        azimuth, time = 2 * math.pi * step / 360, 0.1 * step / 360
        for ring in range(RINGS):
            across = WALL / math.sin(azimuth)
            points += struct.pack("<ffffHf", across * math.cos(azimuth), WALL, across * math.tan(math.radians(ring - 8)), 50, ring, time)
            count += 1
    out = Cdr().header(ns, "velodyne").put("I", 1, count, 6)
    for name, offset, kind in (("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7)):
        out.text(name).put("I", offset).put("B", kind).put("I", 1)
    return out.put("B", 0).put("I", 22, 22 * count).bytes(points).put("B", 1).data


def image(ns):
    pixels = bytearray()
    for y in range(HEIGHT):
        for x in range(WIDTH):
            north = way(ns) + WALL * (x - WIDTH / 2) / FOCAL
            pixels += bytes((200, 30, 30) if is_red(north) else (30, 200, 30))
    return Cdr().header(ns, "camera").put("I", HEIGHT, WIDTH).text("rgb8").put("B", 0).put("I", WIDTH * 3).bytes(pixels).data


def grey_image(ns):
    """What a driver sends beside the colours of the same camera."""
    return Cdr().header(ns, "camera").put("I", HEIGHT, WIDTH).text("mono8").put("B", 0).put("I", WIDTH).bytes(bytes([90]) * (WIDTH * HEIGHT)).data


def calibration(ns):
    """That of the camera's whole image, of which the driver joins two by two pixels."""
    out = Cdr().header(ns, "camera").put("I", 2 * HEIGHT, 2 * WIDTH).text("plumb_bob").put("I", 5).put("d", 0, 0, 0, 0, 0)
    out.put("d", 2 * FOCAL, 0, WIDTH + 0.5, 0, 2 * FOCAL, HEIGHT + 0.5, 0, 0, 1).put("d", *[0] * 9).put("d", *[0] * 12)
    return out.put("I", 2, 2).put("I", 0, 0, 0, 0).put("B", 0).data


def frames(ns, *transforms):
    out = Cdr().put("I", len(transforms))
    for parent, child, place, turn in transforms:
        out.header(ns, parent).text(child).put("d", *place).put("d", *turn)
    return out.data


def moving_frames(ns):
    """As ROS 1 has it: what never changes is sent again and again beside what does."""
    half = math.sqrt(0.5)
    return frames(ns, ("odom", "base_link", (way(ns), 0, 0), (0, 0, 0, 1)), ("base_link", "camera", (0, 0, CAMERA_UP), (-half, 0, 0, half)))


def make_bag(path, only=None, is_simulated=False, of_map=False):
    topics = {"/points": "sensor_msgs/msg/PointCloud2", "/inspvax": "novatel_oem7_msgs/msg/INSPVAX", "/left/image_raw": "sensor_msgs/msg/Image",
              "/left/a_mono": "sensor_msgs/msg/Image",
              "/left/camera_info": "sensor_msgs/msg/CameraInfo", "/tf_static": "tf2_msgs/msg/TFMessage",
              "/tf": "tf2_msgs/msg/TFMessage", "/chatter": "my_msgs/msg/Chatter"}
    scanner = ("base_link", "velodyne", (0, 0, SCANNER_UP), (0, 0, 0, 1))
    messages = [(BEGIN, "/tf_static", frames(BEGIN, scanner)), (BEGIN, "/chatter", b"\0\1\0\0hello")]
    messages += [(BEGIN + k * 10**9, "/tf", moving_frames(BEGIN + k * 10**9)) for k in range(10)]
    if is_simulated or of_map:
        topics["/odom"] = "nav_msgs/msg/Odometry"
    for k in range(round(POSES_S * 50)):
        ns = BEGIN + k * 20_000_000
        if is_simulated or of_map:
            messages.append((ns + 5_000_000, "/odom", map_odometry(ns) if of_map else odometry(ns)))
        else:
            messages.append((ns + 5_000_000, "/inspvax", pose(ns)))
    for k in range(round(CLOUDS_S * 10)):
        ns = BEGIN + round((POSES_S - CLOUDS_S - 1) * 1e9) + k * 100_000_000
        messages.append((ns + 103_000_000, "/points", cloud(ns)))
        messages.append((ns + 67_000_000, "/left/image_raw", image(ns + 37_000_000)))
        messages.append((ns + 67_000_000, "/left/a_mono", grey_image(ns + 37_000_000)))
        messages.append((ns + 67_000_000, "/left/camera_info", calibration(ns + 37_000_000)))
    if only:
        messages = [one for one in messages if one[1] in only]
    if is_simulated:  # the recorder had the true time
        messages = [(ns + 1_700_000_000 * 10**9, name, data) for ns, name, data in messages]
    db = sqlite3.connect(path)
    db.execute("create table topics(id integer primary key, name text, type text, serialization_format text, offered_qos_profiles text)")
    db.execute("create table messages(id integer primary key, topic_id int, timestamp int, data blob)")
    ids = {}
    for number, (name, kind) in enumerate(topics.items(), 1):
        if only and name not in only:
            continue
        db.execute("insert into topics values(?,?,?,?,?)", (number, name, kind, "cdr", ""))
        ids[name] = number
    for ns, name, data in sorted(messages, key=lambda one: one[0]):
        db.execute("insert into messages(topic_id, timestamp, data) values(?,?,?)", (ids[name], ns, data))
    db.commit()
    db.close()


def points_of(las):
    data = open(las, "rb").read()
    begin, size = struct.unpack_from("<I", data, 96)[0], struct.unpack_from("<H", data, 105)[0]
    count, scale, offset = struct.unpack_from("<Q", data, 247)[0], struct.unpack_from("<3d", data, 131), struct.unpack_from("<3d", data, 155)
    for at in range(begin, begin + count * size, size):
        place = [i * s + o for i, s, o in zip(struct.unpack_from("<3i", data, at), scale, offset)]
        yield place, struct.unpack_from("<3H", data, at + 30)


def run(*arguments, status=0):
    done = subprocess.run([hueline, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == status, f"hueline {' '.join(arguments)} gave {done.returncode}, not {status}:\n{done.stdout}"
    return done.stdout


def judge(las):
    """The points lie on the wall, and their colours are those of its stripes."""
    total = coloured = right = 0
    farthest = 0.0
    begin = northing_of(LATITUDE)
    for (east, north, up), (red, green, blue) in points_of(las):
        total += 1
        farthest = max(farthest, abs(500000 - WALL * ALONG - east))
        place = (north - begin) / ALONG
        if max(red, green, blue) == 0 or abs(place / STRIPE - round(place / STRIPE)) < 0.08:
            continue
        coloured += 1
        right += (red > green) == is_red(place)
    wanted = round(CLOUDS_S * 10) * RINGS * len(FIRINGS)
    print(f"{total} points of {wanted}, the wall is at most {farthest:.3f} m off; {right} of {coloured} colours are right")
    assert total == wanted and farthest < 0.03, "points are lost or not on the wall"
    assert coloured > 0.6 * total and right > 0.99 * coloured, "the colours are not those of the wall"


with tempfile.TemporaryDirectory() as work:
    os.chdir(work)
    make_bag("world.db3")
    said = run("import", "world.db3", "--out", "drive")
    for wanted in ("/points", "/left/image_raw", "/inspvax", "/chatter", "my_msgs/Chatter"):
        assert wanted in said, f"{wanted} is not told:\n{said}"
    assert "--clouds does not name it" not in said
    run("import", "world.db3", "--out", "other", "--clouds", "/chatter", status=2)
    run("import", "world.db3", "--out", "other", "--images", "/chatter", status=2)
    assert "/left/image_raw is of the same camera" in said, said
    assert run("import", "world.db3", "--out", "named", "--clouds", "/points") == said.replace("drive/", "named/")
    # Of a recording of which nothing can be taken, the table says why.
    make_bag("nothing.db3", only=("/chatter",))
    nothing = run("import", "nothing.db3", "--out", "nothing", status=3)
    assert "/chatter" in nothing and "the table says why" in nothing, nothing
    rig = open("drive/rig.yaml").read()
    assert "the tree of frames: mountings of the rig" in said and rig.count("by the recording's tree of frames") == 2, said + rig
    assert "driver: ros_cloud" in rig and "time_field: 'time'" in rig and "time_unit: s" in rig, rig
    print(said)
    assert "which `hueline replay` reads" in run("import", "drive", "--out", "again", status=3)
    print(run("replay", "drive", "--out", "cloud", "--no-feed"))
    judge("cloud/cloud.las")
    # An import that does not come to its end leaves what an earlier one has made.
    older = {name: open(f"drive/{name}", "rb").read() for name in ("drive.mcap", "rig.yaml")}
    most = len(older["drive.mcap"]) - 1000
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    refused = subprocess.run([hueline, "import", "world.db3", "--out", "drive", "--images", "/left/image_raw"], text=True,
                             capture_output=True, preexec_fn=limit)
    assert refused.returncode == 4 and "drive.mcap" in refused.stderr, refused
    assert {name: open(f"drive/{name}", "rb").read() for name in older} == older, "a stopped import changed the older drive"
    assert sorted(os.listdir("drive")) == ["drive.mcap", "rig.yaml"], os.listdir("drive")
    # Poses in the coordinates of a map, whose metres and whose north are other ones.
    make_bag("map.db3", of_map=True)
    assert "name the map with --map" in run("import", "map.db3", "--out", "unplaced", "--origin", f"{LATITUDE},{LONGITUDE},{HEIGHT_M}")
    run("import", "map.db3", "--out", "unplaced", "--map", "utm", status=2)
    print(run("import", "map.db3", "--out", "mapped", "--map", "EPSG:2154"))
    print(run("replay", "mapped", "--out", "on_map", "--no-feed"))
    judge("on_map/cloud.las")
    # A simulator's time begins at 0: poses, clouds and images are counted from a date that is told.
    BEGIN = 100 * 10**9
    make_bag("simulated.db3", is_simulated=True)
    said = run("import", "simulated.db3", "--out", "simulated", "--origin", f"{LATITUDE},{LONGITUDE},{HEIGHT_M}")
    assert "begin 100.000 s after 1970" in said and "counted from 2020-01-01" in said, said
    print(said)
    print(run("replay", "simulated", "--out", "virtual", "--no-feed"))
    judge("virtual/cloud.las")
