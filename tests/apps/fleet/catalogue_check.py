#!/usr/bin/env python3
"""Reads a catalogue by the published standard of GeoPackage (OGC 12-128r17) with SQLite, and with GDAL, and compares it with the files of the drives.

usage: catalogue_check.py FLEET.gpkg RESULTS EXPECTED_STATUS_OF_EACH_DRIVE...   (as NAME=STATUS)
"""
import hashlib, json, math, os, sqlite3, struct, subprocess, sys

path, results = sys.argv[1:3]
expected = dict(word.split("=") for word in sys.argv[3:])
base = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
base.row_factory = sqlite3.Row


def one(sql):
    return base.execute(sql).fetchone()[0]


# Requirements 2, 6, 7: the file's marks and its integrity.
assert open(path, "rb").read(72)[68:] == b"GPKG"
assert one("PRAGMA user_version") >= 10200
assert one("PRAGMA integrity_check") == "ok"
assert base.execute("PRAGMA foreign_key_check").fetchall() == []
# Requirement 11: the reference systems.
assert {row[0] for row in base.execute("SELECT srs_id FROM gpkg_spatial_ref_sys")} >= {-1, 0, 4326}
contents = {row["table_name"]: row for row in base.execute("SELECT * FROM gpkg_contents")}
assert contents["drives"]["data_type"] == "features" and contents["products"]["data_type"] == "attributes"
assert tuple(base.execute("SELECT * FROM gpkg_geometry_columns").fetchone()) == ("drives", "line", "LINESTRING", 4326, 0, 0)


def line_of(blob):
    """2.1.3: the header and the well-known binary."""
    magic, version, flags, srs, west, east, south, north = struct.unpack_from("<2sBBi4d", blob)
    assert (magic, version, flags, srs) == (b"GP", 0, 3, 4326)
    order, kind, count = struct.unpack_from("<BII", blob, 40)
    assert (order, kind, len(blob)) == (1, 2, 49 + 16 * count) and count >= 2
    line = list(struct.iter_unpack("<2d", blob[49:]))
    assert (west, east) == (min(x for x, _ in line), max(x for x, _ in line))
    assert (south, north) == (min(y for _, y in line), max(y for _, y in line))
    return line


drives = {row["name"]: row for row in base.execute("SELECT * FROM drives")}
assert {name: row["status"] for name, row in drives.items()} == expected, {name: row["status"] for name, row in drives.items()}
for name, row in drives.items():
    products = base.execute("SELECT file, bytes, sha256 FROM products WHERE drive_fid = ?", (row["fid"],)).fetchall()
    if row["status"] not in ("done", "damaged"):
        assert products == [] and row["text"] != "" and row["results"] is None
        continue
    assert [file for file, *_ in products] == ["cloud.las", "report.html", "report.pdf", "summary.json", "view.mcap"], products
    for file, size, sha256 in products:
        data = open(os.path.join(results, name, file), "rb").read()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (size, sha256)
    summary = json.load(open(os.path.join(results, name, "summary.json")))
    assert row["verdict"] == summary["verdict"]["grade"]
    if row["status"] == "damaged":
        continue
    assert (row["begin_utc"], row["path_m"], row["duration_s"]) == tuple(summary["drive"][key] for key in ("begin", "path_m", "duration_s"))
    assert (row["points"], row["coloured_share"]) == (summary["points"]["total"], summary["points"]["coloured_share"])
    # The line has a place a second, and leads about as far as the vehicle drove. On a sphere, which is near enough.
    line = line_of(row["line"])
    assert abs(len(line) - row["duration_s"]) <= 2
    metre = math.pi / 180 * 6371000
    length = sum(math.hypot((a[0] - b[0]) * math.cos(math.radians(a[1])), a[1] - b[1]) * metre for a, b in zip(line, line[1:]))
    assert 0.5 * row["path_m"] < length < 1.1 * row["path_m"], (length, row["path_m"])
bounds = contents["drives"]
lines = [line_of(row["line"]) for row in drives.values() if row["line"]]
assert bounds["min_x"] == min(x for line in lines for x, _ in line) and bounds["max_y"] == max(y for line in lines for _, y in line)

# GDAL sees the same.
table = json.loads(subprocess.run(["ogr2ogr", "-f", "GeoJSON", "-lco", "COORDINATE_PRECISION=15", "/vsistdout/", path, "drives"],
                                  check=True, capture_output=True, text=True).stdout)
assert len(table["features"]) == len(drives)
for feature in table["features"]:
    row = drives[feature["properties"]["name"]]
    assert feature["properties"]["rig_sha256"] == row["rig_sha256"]
    if row["line"]:
        for found, wanted in zip(feature["geometry"]["coordinates"], line_of(row["line"]), strict=True):
            assert math.dist(found, wanted) < 1e-12
told = subprocess.run(["ogrinfo", "-ro", "-al", "-so", path], check=True, capture_output=True, text=True)
assert "Layer name: drives" in told.stdout and "Layer name: products" in told.stdout and not told.stderr, told.stderr
