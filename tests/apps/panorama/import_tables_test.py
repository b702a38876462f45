#!/usr/bin/env python3
"""Reads a table for other programs as these describe it, checks it against the tables beside it, and says at which pixels of the panorama measured
objects must be.

usage: import_tables_test.py FOLDER pano-poses|pointerra|orbit MEASURED PICKS
"""
import csv, datetime, json, math, re, subprocess, sys

folder, table, measured, picks = sys.argv[1:]
own = list(csv.DictReader(open(folder + "/panoramas.csv")))[0]


def near(what, a, b, most):
    if not abs(a - b) <= most:
        sys.exit(f"FAILED: {folder}: {what} is {a}, and not {b}")


# Mapillary's description, by its published schema.
entry = json.load(open(folder + "/mapillary_image_description.json"))[0]
allowed = {"MAPLatitude", "MAPLongitude", "MAPCaptureTime", "MAPCompassHeading", "MAPGPSAccuracyMeters", "filename", "filetype"}
if set(entry) - allowed or entry["filetype"] != "image" or entry["filename"] != own["file"] or set(entry["MAPCompassHeading"]) != {"TrueHeading", "MagneticHeading"}:
    sys.exit(f"FAILED: {entry} is not as Mapillary describes it")
if not re.fullmatch("[0-9]{4}_[0-9]{2}_[0-9]{2}_[0-9]{2}_[0-9]{2}_[0-9]{2}_[0-9]+", entry["MAPCaptureTime"]):
    sys.exit("FAILED: " + entry["MAPCaptureTime"])
taken = datetime.datetime.fromisoformat(own["utc"].replace("Z", "+00:00"))
near("the time for Mapillary", datetime.datetime.strptime(entry["MAPCaptureTime"] + "000 +0000", "%Y_%m_%d_%H_%M_%S_%f %z").timestamp(), taken.timestamp(), 1e-3)
near("the latitude for Mapillary", entry["MAPLatitude"], float(own["latitude_deg"]), 1e-9)
near("the heading for Mapillary", entry["MAPCompassHeading"]["TrueHeading"], float(own["heading_deg"]), 1e-3)

if table == "pano-poses":
    head, line = open(folder + "/pano-poses.csv").read().split("\n")[:2]
    if head != "# pano poses v1.0: ID; filename; timestamp; pano_pos_x; pano_pos_y; pano_pos_z; pano_ori_w; pano_ori_x; pano_ori_y; pano_ori_z":
        sys.exit("FAILED: " + head)
    words = [word.strip() for word in line.split(";")]
    name, seconds, place = words[1], float(words[2]), [float(w) for w in words[3:6]]
    w, x, y, z = (float(w) for w in words[6:])
    forward = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    up = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
elif table == "orbit":
    # Tabs, lines that end as on Windows, names without their ends, degrees clockwise from the north of the map.
    text = open(folder + "/orbit.txt", newline="").read()
    head, line = text.split("\r\n")[:2]
    if head.split("\t") != ["Filename", "X/Long", "Y/Lat", "Z", "Pan", "Tilt", "Roll", "Timestamp"] or text.count("\n") != text.count("\r\n"):
        sys.exit("FAILED: " + head)
    words = line.split("\t")
    name, place, pan = words[0] + ".jpg", [float(w) for w in words[1:4]], math.radians(float(words[4]))
    forward, up, seconds = [math.sin(pan), math.cos(pan), 0], [0, 0, 1], taken.timestamp()
    near("tilt and roll", abs(float(words[5])) + abs(float(words[6])), 0, 0)
    near("the GPS time", float(words[7]), float(own["gps_s"]), 1e-6)
else:
    row = list(csv.DictReader(open(folder + "/pointerra.csv")))[0]
    if len(row) != 17:
        sys.exit(f"FAILED: {len(row)} columns")
    name, seconds = row["Filename"], float(row["Timestamp"])
    place = [float(row["Origin " + c]) for c in ("Easting", "Northing", "Height")]
    forward = [float(row["Direction " + c]) for c in ("East", "North", "Height")]
    up = [float(row["Up " + c]) for c in ("East", "North", "Height")]
    near("the yaw", math.degrees(math.atan2(forward[0], forward[1])) % 360, float(row["Yaw[deg]"]), 1e-3)
    near("the pitch", math.degrees(math.asin(forward[2])), float(row["Pitch[deg]"]), 1e-3)
left = [up[1] * forward[2] - up[2] * forward[1], up[2] * forward[0] - up[0] * forward[2], up[0] * forward[1] - up[1] * forward[0]]
if name != own["file"]:
    sys.exit("FAILED: " + name)
near("the time", seconds, taken.timestamp(), 2e-6)
for value, column in zip(place, ("easting_m", "northing_m", "height_m")):
    near(column, value, float(own[column]), 1e-4)
near("the level", up[2], 1, 1e-9 if own["pixels_are_gravity_aligned"] == "1" else 0.01)
if (own["pixels_are_gravity_aligned"] == "1") != (folder != "tilted"):
    sys.exit("FAILED: which pixels are gravity-aligned")

rows = [row for row in csv.DictReader(line for line in open(measured) if not line.startswith("#")) if row["latitude_deg"]]
text = "".join(f"{row['latitude_deg']} {row['longitude_deg']} {row['height_m']}\n" for row in rows)
zone = int((float(own["longitude_deg"]) + 180) // 6) + 1
said = subprocess.run(["cs2cs", "-f", "%.5f", "EPSG:4979", "+to", f"EPSG:{32600 + zone}"], input=text, capture_output=True, text=True, check=True).stdout
width = int(own["width_px"])
with open(picks, "w") as out:
    out.write("name,exposure,u_px,v_px\n")
    for row, line in zip(rows, said.splitlines()):
        to = [float(a) - b for a, b in zip(line.split(), place)]
        x, y, z = (sum(a * b for a, b in zip(axis, to)) for axis in (forward, left, up))
        u, v = (0.5 - math.atan2(y, x) / (2 * math.pi)) * width - 0.5, math.atan2(math.hypot(x, y), z) / math.pi * width / 2 - 0.5
        out.write(f"{row['name']},{own['exposure']},{u:.3f},{v:.3f}\n")
