#!/usr/bin/env python3
"""Has GDAL read the trajectory that `hueline export --profile trajectory` wrote for maps, and compares it with the CSV file, each pose with its own.
Then exports the path that post-processing gave: trajectory and strips by distance follow it.

usage: trajectory_readers_test.py HUELINE IMAGE_PROOF
"""
import csv, datetime, json, math, os, struct, subprocess, sys, tempfile

HUELINE, PROOF = (os.path.abspath(path) for path in sys.argv[1:3])
SCENARIO = """seed: 5
duration_s: 3
drive: {stand_s: 0, accelerate_s: 0.5, speed: 6}
camera: {rate_hz: 2, lens_width: 64, lens_height: 54}
"""
SHIFTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "shifted_sbet.py")
DEGREE_M = 111_320  # of latitude; of longitude it is less


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"FAILED: {' '.join(words)} gave {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def read(path, *layer):
    """The features as GDAL reads them, in longitude and latitude of WGS 84."""
    return json.loads(run("ogr2ogr", "-f", "GeoJSON", "-lco", "COORDINATE_PRECISION=12", "-t_srs", "EPSG:4979", "/vsistdout/", path, *layer))["features"]


def same(name, place, row):
    wanted = [float(row["longitude_deg"]), float(row["latitude_deg"]), float(row["ellipsoidal_height_m"])]
    off = [abs(a - b) for a, b in zip(place, wanted)]
    if max(off[:2]) * DEGREE_M > 1e-3 or (len(off) > 2 and off[2] > 1e-3):
        sys.exit(f"FAILED: {name} has {place}, and the CSV file {wanted}")


def same_time(name, text, row):
    text = text.replace("/", "-").replace(" ", "T").replace("+00", "").rstrip("Z")
    wanted = row["utc"].rstrip("Z")
    off = datetime.datetime.fromisoformat(text) - datetime.datetime.fromisoformat(wanted)
    if abs(off.total_seconds()) > 1e-3:
        sys.exit(f"FAILED: {name} has {text}, and the CSV file {wanted}")


def check_post_processed(rows):
    """Exports the drive by a trajectory that lies 2e-7 rad farther north, and by one that goes to and fro at each record."""
    export = (HUELINE, "export", "drive", "--profile")
    run(HUELINE, "simulate", "short.yaml", "--out", "sim", "--trajectory", "true.sbet")
    run(sys.executable, SHIFTED, "true.sbet", "shifted.sbet", "2e-7", "0")
    said = run(*export, "trajectory", "--rate", "10", "--out", "post.csv", "--trajectory", "shifted.sbet")
    if "shifted.sbet in place of the POS's solutions" not in said:
        sys.exit("FAILED: the trajectory is not compared with the POS: " + said)
    post = {row["gps_second"]: row for row in csv.DictReader(open("post.csv"))}
    both = [(row, post[row["gps_second"]]) for row in rows if row["gps_second"] in post]
    if len(both) < len(rows) - 2:
        sys.exit(f"FAILED: {len(both)} of the {len(rows)} poses of the POS are in the trajectory of post-processing")
    north = [math.radians(float(b["latitude_deg"]) - float(a["latitude_deg"])) for a, b in both]
    if abs(sum(north) / len(north) - 2e-7) > 2e-8:
        sys.exit(f"FAILED: post-processed poses lie {sum(north) / len(north)} rad north of the POS's, not 2e-7")

    with open("true.sbet", "rb") as source, open("fro.sbet", "wb") as out:
        for i, record in enumerate(struct.Struct("<17d").iter_unpack(source.read())):
            out.write(struct.pack("<17d", record[0], record[1] + (i % 2) * 1e-7, *record[2:]))
    run(HUELINE, "replay", "drive", "--out", "drive")
    strips = []
    for name, more in (("pos", ()), ("post", ("--trajectory", "fro.sbet"))):
        run(*export, "laz", "--split", "distance:5m", "--out", name, *more)
        strips.append(sum(file.endswith(".laz") for file in os.listdir(name)))
    # A second of the drive is 6 m for the POS, and at least 200 steps of 0.6 m for the other.
    if not 2 <= strips[0] <= 5 or strips[1] < 4 * strips[0]:
        sys.exit(f"FAILED: {strips[0]} strips by the POS's path and {strips[1]} by one that is ten times as long")
    print(f"post-processing: {len(both)} poses {sum(north) / len(north):.2e} rad farther north; {strips[1]} strips in place of {strips[0]}")


def refused(status, sentence, *words):
    done = subprocess.run((HUELINE, "export", "drive", "--profile", "trajectory", *words), capture_output=True, text=True, timeout=60)
    if done.returncode != status or sentence not in done.stderr:
        sys.exit(f"FAILED: {' '.join(words)} gave {done.returncode}, not {status} with '{sentence}': {done.stderr}")


def check_refused():
    """What is refused leaves what an earlier export wrote."""
    with open("t.csv", "rb") as file:
        before = file.read()
    with open("of_another.sbet", "wb") as out:
        for i in range(1000):
            out.write(struct.pack("<17d", 100 + i / 100, 0.1, 0.1, 50.0, *[0.0] * 13))
    refused(2, "of_another.sbet", "--out", "t.csv", "--trajectory", "of_another.sbet")
    refused(2, "--rate 1e-300: allowed is 0, or 0.001 to 10000", "--out", "t.csv", "--rate", "1e-300")
    refused(2, "--at pos: no scanner or camera of the rig has that name; it has: laser, camera", "--out", "t.csv", "--at", "pos")
    os.mkdir("t.smrmsg")
    with open("t.out", "w") as file:
        file.write("earlier")
    refused(4, "t.smrmsg: Is a directory", "--out", "t.out")
    with open("t.csv", "rb") as file, open("t.out") as sbet:
        if file.read() != before or sbet.read() != "earlier":
            sys.exit("FAILED: an export that was refused changed what was there")
    left = [name for name in os.listdir() if name.endswith(".part")]
    if left:
        sys.exit(f"FAILED: left {left}")


def main():
    with open("short.yaml", "w") as file:
        file.write(SCENARIO)
    os.makedirs("drive")
    run(PROOF, "short.yaml", "sim", "drive")
    for ending in ("csv", "gpx", "kml", "geojson"):
        run(HUELINE, "export", "drive", "--profile", "trajectory", "--rate", "10", "--out", "t." + ending)
    rows = list(csv.DictReader(open("t.csv")))
    moved = abs(float(rows[-1]["latitude_deg"]) - float(rows[0]["latitude_deg"])) * DEGREE_M
    if len(rows) < 50 or moved < 5:
        sys.exit(f"FAILED: {len(rows)} poses, {moved:.1f} m to the north: too few to compare")

    points = read("t.gpx", "track_points")
    tracks = read("t.gpx", "tracks")
    if len(points) != len(rows) or len(tracks) != 1 or tracks[0]["properties"]["name"] != "street":
        sys.exit(f"FAILED: GPX has {len(tracks)} tracks with {len(points)} points, and the CSV file {len(rows)} poses")
    for point, row in zip(points, rows):
        same("GPX", point["geometry"]["coordinates"][:2], row)
        if point["properties"].get("ele") is not None:
            sys.exit("FAILED: GPX has a height, which programs take for one above the sea")
        same_time("GPX", point["properties"]["time"], row)

    lines = read("t.kml")
    if len(lines) != 1 or lines[0]["properties"]["Name"] != "street" or lines[0]["geometry"]["type"] != "LineString":
        sys.exit(f"FAILED: KML has {len(lines)} features: {json.dumps(lines)[:300]}")
    places = lines[0]["geometry"]["coordinates"]
    if len(places) != len(rows):
        sys.exit(f"FAILED: KML has {len(places)} places, and the CSV file {len(rows)} poses")
    for place, row in zip(places, rows):
        same("KML", place[:2], row)  # the line lies on the ground

    features = read("t.geojson")
    if len(features) != len(rows):
        sys.exit(f"FAILED: GeoJSON has {len(features)} features, and the CSV file {len(rows)} poses")
    for feature, row in zip(features, rows):
        same("GeoJSON", feature["geometry"]["coordinates"], row)
        same_time("GeoJSON", feature["properties"]["time"], row)
        for angle in ("roll_deg", "pitch_deg", "heading_deg"):
            if abs(feature["properties"][angle] - float(row[angle])) > 1e-4:
                sys.exit(f"FAILED: GeoJSON has {feature['properties']}, and the CSV file {row}")
    print(f"GDAL reads {len(rows)} poses from GPX, KML and GeoJSON as they are in the CSV file")
    check_refused()
    check_post_processed(rows)


with tempfile.TemporaryDirectory() as work:
    os.chdir(work)
    main()
