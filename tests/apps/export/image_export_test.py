#!/usr/bin/env python3
"""Reads what `hueline export --profile images` wrote by the published formats alone, and looks for places that the simulator's lenses truly saw.

usage: image_export_test.py HUELINE IMAGE_PROOF
"""
import csv, json, math, os, struct, subprocess, sys, tempfile, zlib

HUELINE, PROOF = sys.argv[1:3]
SHIFTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "shifted_sbet.py")
SCENARIO = """seed: 5
duration_s: 3
noise: false
drive: {stand_s: 0, accelerate_s: 0.5, speed: 6}
camera: {rate_hz: 2, lens_width: 204, lens_height: 170, lens_model: %s}
"""


def fail(text):
    sys.exit("FAILED: " + text)


def run(*words, status=0):
    done = subprocess.run(words, capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode != status:
        fail(f"{' '.join(words)} gave {done.returncode}, not {status}: {said}")
    return said


# --- linear algebra and the earth, in plain numbers
def times(m, v):
    return [sum(a * b for a, b in zip(row, v)) for row in m]


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transposed(m):
    return [list(c) for c in zip(*m)]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def of_quaternion(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def turn(axis, a):
    c, s = math.cos(a), math.sin(a)
    return {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]


def ecef(latitude, longitude, height):
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)
    n = a / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
    return [(n + height) * math.cos(latitude) * math.cos(longitude), (n + height) * math.cos(latitude) * math.sin(longitude),
            (n * (1 - e2) + height) * math.sin(latitude)]


def level_of(latitude, longitude):
    """Rows: east, north, up in ECEF."""
    sp, cp, sl, cl = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    return [[-sl, cl, 0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]]


# --- lens models: colmap.github.io/cameras.html
def project(model, p, x, y, z):
    if z <= 0:
        return None
    x, y = x / z, y / z
    if model == "OPENCV_FISHEYE":
        r = math.hypot(x, y)
        t = math.atan(r)
        f = t * (1 + p[4] * t**2 + p[5] * t**4 + p[6] * t**6 + p[7] * t**8) / r if r > 0 else 1
        x, y = x * f, y * f
    elif model in ("OPENCV", "FULL_OPENCV"):
        r2 = x * x + y * y
        radial = 1 + p[4] * r2 + p[5] * r2**2 + (p[8] * r2**3 if model == "FULL_OPENCV" else 0)
        if model == "FULL_OPENCV":
            radial /= 1 + p[9] * r2 + p[10] * r2**2 + p[11] * r2**3
        x, y = (x * radial + 2 * p[6] * x * y + p[7] * (r2 + 2 * x * x), y * radial + p[6] * (r2 + 2 * y * y) + 2 * p[7] * x * y)
    elif model != "PINHOLE":
        fail("an unknown camera model " + model)
    return p[0] * x + p[2], p[1] * y + p[3]


def lines_of(path):
    with open(path) as file:
        return [line.rstrip("\n") for line in file if not line.startswith("#")]


def read_colmap(folder):
    cameras, images = {}, {}
    for line in lines_of(folder + "/cameras.txt"):
        words = line.split()
        cameras[int(words[0])] = (words[1], int(words[2]), int(words[3]), [float(w) for w in words[4:]])
    lines = lines_of(folder + "/images.txt")
    for i in range(0, len(lines), 2):
        words = lines[i].split()
        if len(words) != 10:
            fail("images.txt: " + lines[i])
        numbers = [float(w) for w in words[1:8]]
        images["images/" + words[9]] = (of_quaternion(*numbers[:4]), numbers[4:], cameras[int(words[8])])
    points = [line.split() for line in lines_of(folder + "/points3D.txt")]
    return images, [([float(w) for w in p[1:4]], [int(w) for w in p[4:7]]) for p in points]


def read_tracks(folder):
    """What each image observes: pixel and number of a point. Of each point: place, error, and where it is observed."""
    lines = lines_of(folder + "/images.txt")
    names = {int(line.split()[0]): "images/" + line.split()[9] for line in lines[::2]}
    seen = {}
    for line, words in zip(lines[::2], (line.split() for line in lines[1::2])):
        seen["images/" + line.split()[9]] = [(float(words[i]), float(words[i + 1]), int(words[i + 2])) for i in range(0, len(words), 3)]
    points = {}
    for p in (line.split() for line in lines_of(folder + "/points3D.txt")):
        points[int(p[0])] = ([float(w) for w in p[1:4]], float(p[7]), [(names[int(p[i])], int(p[i + 1])) for i in range(8, len(p), 2)])
    return seen, points


def check_by_colmap(folder):
    """COLMAP's own reader has the same cameras, poses and points: it writes them in its binary form, and again as text."""
    for kind in ("BIN", "TXT"):
        os.makedirs(folder + "/" + kind)
        run("colmap", "model_converter", "--input_path", folder + ("/sparse/0" if kind == "BIN" else "/BIN"), "--output_path", folder + "/" + kind, "--output_type", kind)
    (ours, our_points), (theirs, their_points) = read_colmap(folder + "/sparse/0"), read_colmap(folder + "/TXT")
    if ours.keys() != theirs.keys() or len(our_points) != len(their_points):
        fail(f"COLMAP reads {len(theirs)} of {len(ours)} images and {len(their_points)} of {len(our_points)} points")
    for file, (R, t, camera) in ours.items():
        other_R, other_t, other = theirs[file]
        if camera[:3] != other[:3] or math.dist(camera[3], other[3]) > 1e-6:
            fail(f"{file}: COLMAP reads the camera {other}, not {camera}")
        if math.dist(t, other_t) > 1e-6 or max(math.dist(a, b) for a, b in zip(R, other_R)) > 1e-9:
            fail(f"{file}: COLMAP reads another pose")
    # COLMAP gives the points in no order.
    for (place, rgb), (other, other_rgb) in zip(sorted(our_points), sorted(their_points)):
        if math.dist(place, other) > 1e-6 or rgb != other_rgb:
            fail(f"COLMAP reads the point {other} {other_rgb}, not {place} {rgb}")
    (seen, points), (their_seen, their_points) = read_tracks(folder + "/sparse/0"), read_tracks(folder + "/TXT")
    for file in seen:
        if [one[2] for one in seen[file]] != [one[2] for one in their_seen[file]] or any(math.dist(a, b) > 1e-3 for a, b in zip(seen[file], their_seen[file])):
            fail(f"{file}: COLMAP reads other observations")
    for number, (_, error, track) in points.items():
        if sorted(track) != sorted(their_points[number][2]) or abs(error - their_points[number][1]) > 1e-6:
            fail(f"COLMAP reads another track of the point {number}")
    said = run("colmap", "model_analyzer", "--path", folder + "/sparse/0")
    if f"Observations: {sum(len(one) for one in seen.values())}" not in said:
        fail("colmap model_analyzer says " + said)


def check_tracks(folder, model, images):
    """Observations are where the poses show the points, and the simulator's lenses truly saw the points there."""
    seen, points = read_tracks(folder + "/sparse/0")
    world = json.load(open(folder + "/transforms.json"))["world"]
    latitude, longitude = math.radians(world["latitude_deg"]), math.radians(world["longitude_deg"])
    origin, level = ecef(latitude, longitude, world["ellipsoidal_height_m"]), level_of(latitude, longitude)
    rows = {row["file"]: row for row in csv.DictReader(open(folder + "/poses.csv"))}
    lenses = sorted({row["lens"] for row in rows.values()})
    moments = sorted({round(float(row["gps_s"]) * 1e9) for row in csv.DictReader(open(model + "/sights.csv"))})
    asked, places = [], open("places.txt", "w")
    for file, observed in seen.items():
        R, t, camera = images[file]
        for i, (u, v, number) in enumerate(observed):
            place, _, track = points[number]
            pixel = project(camera[0], camera[3], *[a + b for a, b in zip(times(R, place), t)])
            if (file, i) not in track or not inside(camera, pixel) or math.dist(pixel, (u, v)) > 0.002:
                fail(f"{file} observes the point {number} at {u}, {v}, and it is at {pixel}")
            taken = min(moments, key=lambda time: abs(time * 1e-9 - float(rows[file]["gps_s"])))
            print(taken, lenses.index(rows[file]["lens"]), *[a + b for a, b in zip(times(transposed(level), place), origin)], file=places)
            asked.append((u, v))
    places.close()
    if sum(len(track) for _, _, track in points.values()) != len(asked) or any((error < 0) != (not track) for _, error, track in points.values()):
        fail("tracks of points that are not observed")
    if any(len({file for file, _ in track}) != len(track) for _, _, track in points.values()):
        fail("a point is twice in an image")
    run(PROOF, model + ".yaml", "sim", model, "places.txt")
    hidden, off = 0, []
    for (u, v), row in zip(asked, csv.DictReader(open(model + "/answers.csv"))):
        distance, met = float(row["distance_m"]), float(row["seen_m"])
        hidden += 0 < met < distance - 0.1 - 0.01 * distance
        off.append(math.dist((float(row["u"]) + 0.5, float(row["v"]) + 0.5), (u, v)))
    shared = sum(len(track) > 1 for _, _, track in points.values())
    off.sort()
    print(f"{folder}: {len(asked)} observations, {hidden} hidden; {shared} of {len(points)} points in several images")
    if folder.endswith("recorded"):
        print(f"  off {off[len(off) // 2]:.4f} px, at most {off[-1]:.4f} px")
        if off[-1] > 0.2:
            fail("points are not where the lenses saw them")
    if len(asked) < 5000 or hidden > 0.01 * len(asked) or shared < 0.5 * len(points):
        fail("observations")


def read_png(path):
    data = open(path, "rb").read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        fail(path + " is no PNG")
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    if (depth, colour) != (8, 2):
        fail(path + " is no 8-bit RGB")
    raw, row, rows = zlib.decompress(packed), bytearray(3 * width), []
    for v in range(height):
        kind, line = raw[v * (3 * width + 1)], bytearray(raw[v * (3 * width + 1) + 1:(v + 1) * (3 * width + 1)])
        for i in range(len(line)):
            a, b, c = (line[i - 3] if i >= 3 else 0), row[i], (row[i - 3] if i >= 3 else 0)
            q = a + b - c
            paeth = min((abs(q - a), 0, a), (abs(q - b), 1, b), (abs(q - c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        row = line
        rows.append(bytes(line))
    return width, height, rows


def colour(picture, u, v):
    """The colour at a place whose first pixel covers [0, 1), bilinear."""
    width, height, rows = picture
    u, v = u - 0.5, v - 0.5
    x, y = int(math.floor(u)), int(math.floor(v))
    if x < 4 or y < 4 or x + 5 >= width or y + 5 >= height:
        return None
    fx, fy = u - x, v - y
    return [(1 - fy) * ((1 - fx) * rows[y][3 * x + c] + fx * rows[y][3 * x + 3 + c]) + fy * ((1 - fx) * rows[y + 1][3 * x + c] + fx * rows[y + 1][3 * x + 3 + c])
            for c in range(3)]


def inside(camera, pixel):
    return pixel is not None and 0 <= pixel[0] < camera[1] and 0 <= pixel[1] < camera[2]


def check_tables(folder, sights, is_recorded):
    """Finds each true place in the picture that shows it, by four poses. Returns those of COLMAP."""
    images, points = read_colmap(folder + "/sparse/0")
    scene = json.load(open(folder + "/transforms.json"))
    world = scene["world"]
    latitude, longitude = math.radians(world["latitude_deg"]), math.radians(world["longitude_deg"])
    origin, level = ecef(latitude, longitude, world["ellipsoidal_height_m"]), level_of(latitude, longitude)
    frames = {frame["file_path"]: frame for frame in scene["frames"]}
    rows = list(csv.DictReader(open(folder + "/poses.csv")))
    if not (len(rows) == len(frames) == len(images) > 30) or scene["pixels_are_gravity_aligned"] is not False:
        fail(f"{len(rows)} poses, {len(frames)} frames, {len(images)} images")
    lenses = sorted({row["lens"] for row in rows})
    places = [s[3] for key in sights for s in sights[key]]
    text = "\n".join("%.5f %.5f %.5f" % tuple(p) for p in places)
    zone = int((world["longitude_deg"] + 180) // 6) + 1
    said = subprocess.run(["cs2cs", "-f", "%.5f", "+proj=geocent +datum=WGS84", "+to", f"+proj=utm +zone={zone} +datum=WGS84"], input=text,
                          capture_output=True, text=True, check=True).stdout
    on_map = {tuple(p): [float(w) for w in line.split()] for p, line in zip(places, said.splitlines())}
    worst, found = {"colmap": 0, "nerfstudio": 0, "omega phi kappa": 0, "heading pitch roll": 0}, 0
    for row in rows:
        file = row["file"]
        if not os.path.exists(os.path.join(folder, file)) or row["pixels_are_gravity_aligned"] != "0":
            fail(file + " is not there")
        time = min(sights, key=lambda key: (key[1] != lenses.index(row["lens"]), abs(key[0] - float(row["gps_s"]))))
        if abs(time[0] - float(row["gps_s"])) > 2e-5 or time[1] != lenses.index(row["lens"]):
            fail(f"{file} was taken at {row['gps_s']}, and no lens was exposed then")
        seconds = float(row["utc"][17:-1])
        if abs((seconds + 18 - float(row["gps_s"]) + 30) % 60 - 30) > 2e-6:
            fail(f"{file}: {row['utc']} is not {row['gps_s']}")
        R, t, camera = images[file]
        model, parameters = camera[0], camera[3]
        frame = frames[file]
        k = [frame.get(name, 0) for name in (("k1", "k2", "k3", "k4") if model == "OPENCV_FISHEYE" else ("k1", "k2", "p1", "p2", "k3"))]
        nerf = ({"OPENCV_FISHEYE": "OPENCV_FISHEYE"}.get(scene["camera_model"], "FULL_OPENCV"),
                [frame["fl_x"], frame["fl_y"], frame["cx"], frame["cy"]] + k + [0] * 3)
        if (frame["w"], frame["h"]) != camera[1:3]:
            fail(file + " has two sizes")
        opk = product(product(turn("x", math.radians(float(row["omega_deg"]))), turn("y", math.radians(float(row["phi_deg"])))),
                      turn("z", math.radians(float(row["kappa_deg"]))))
        here = [math.radians(float(row["latitude_deg"])), math.radians(float(row["longitude_deg"]))]
        here_ecef, here_level = ecef(*here, float(row["ellipsoidal_height_m"])), level_of(*here)
        heading, pitch, roll = (math.radians(float(row[name + "_deg"])) for name in ("heading", "pitch", "roll"))
        look = product(product(turn("z", -heading), turn("x", pitch)), turn("y", roll))  # columns: right, forward, up
        for u, v, _, place in sights[time]:
            enu = times(level, minus(place, origin))
            pixels = {}
            pixels["colmap"] = project(model, parameters, *[a + b for a, b in zip(times(R, enu), t)])
            if not inside(camera, pixels["colmap"]):
                continue  # outside a pinhole
            matrix = frame["transform_matrix"]
            x, y, z = times(transposed([r[:3] for r in matrix[:3]]), minus(enu, [r[3] for r in matrix[:3]]))
            pixels["nerfstudio"] = project(*nerf, x, -y, -z)
            x, y, z = times(transposed(opk), minus(on_map[tuple(place)], [float(row[n]) for n in ("easting_m", "northing_m", "height_m")]))
            pixels["omega phi kappa"] = project(model, parameters, x, -y, -z)
            right, forward, up = times(transposed(look), times(here_level, minus(place, here_ecef)))
            pixels["heading pitch roll"] = project(model, parameters, right, -up, forward)
            found += 1
            wanted = (u + 0.5, v + 0.5) if is_recorded else pixels["colmap"]
            for name, pixel in pixels.items():
                if pixel is None:
                    fail(f"{file}: {name} does not show a place at all")
                worst[name] = max(worst[name], math.dist(pixel, wanted))
    print(folder, found, "places;", ", ".join(f"{name} {px:.4f} px" for name, px in worst.items()))
    # The map's scale and the bending of its straight lines are in the third; the others are exact but for the POS.
    if found < 500 or max(worst.values()) > 0.2:
        fail("places are not where the lenses saw them")
    if not 1000 <= len(points) <= 20000:
        fail(f"{len(points)} points")
    head = open(folder + "/points.ply", "rb").read()
    begin = head.index(b"end_header\n") + 11
    if f"element vertex {len(points)}\n".encode() not in head or len(head) - begin != 15 * len(points):
        fail("points.ply")
    first = struct.unpack("<3f3B", head[begin:begin + 15])
    if math.dist(first[:3], points[0][0]) > 1e-3 or list(first[3:]) != points[0][1]:
        fail("points.ply has other points than points3D.txt")
    return images


def check_colours(recorded, pinhole, images, straight):
    """Undistorted pictures show the same things as recorded ones."""
    same, shifted, count = 0, 0, 0
    for file in sorted(images)[:6]:
        a, b = read_png(os.path.join(recorded, file)), read_png(os.path.join(pinhole, file))
        (R, t, camera), (_, _, other) = images[file], straight[file]
        if a[:2] != camera[1:3] or b[:2] != other[1:3]:
            fail(file + " has another size than its camera")
        dark = sum(row[3 * x:3 * x + 3] == b"\0\0\0" for row in b[2] for x in (0, b[0] - 1)) + (b[2][0] + b[2][-1]).count(b"\0\0\0")
        for x in range(8, b[0] - 8, 7):
            for y in range(8, b[1] - 8, 7):
                p = other[3]
                ray = ((x + 0.5 - p[2]) / p[0], (y + 0.5 - p[3]) / p[1], 1)
                pixel = project(camera[0], camera[3], *ray)
                want, here, beside = colour(a, *pixel), colour(b, x + 0.5, y + 0.5), colour(b, x + 3.5, y + 0.5)
                if want and here and beside:
                    same += sum(abs(i - j) for i, j in zip(want, here))
                    shifted += sum(abs(i - j) for i, j in zip(want, beside))
                    count += 3
        if dark > 20:
            fail(f"{file}: {dark} pixels of the border have no source")
    print(f"undistorted against recorded: {same / count:.3f} levels; three pixels beside: {shifted / count:.3f}")
    if same / count > 1.5 or shifted < 2 * same:
        fail("undistorted pictures show other things")


def main():
    for model in ("kannala_brandt", "brown"):
        open(model + ".yaml", "w").write(SCENARIO % model)
        os.makedirs(model)
        run(PROOF, model + ".yaml", "sim", model)
        sights = {}
        for row in csv.DictReader(open(model + "/sights.csv")):
            key = (float(row["gps_s"]), int(row["lens"]))
            sights.setdefault(key, []).append((int(row["u"]), int(row["v"]), key, [float(row[c]) for c in "xyz"]))
        export = [HUELINE, "export", model, "--profile", "images", "--points", "20000"]
        said = run(*export, "--out", model + "/recorded", "--format", "png")
        if "36 pictures of 6 exposures" not in said:
            fail(said)
        images = check_tables(model + "/recorded", sights, True)
        check_by_colmap(model + "/recorded")
        check_tracks(model + "/recorded", model, images)
        run(*export, "--out", model + "/pinhole", "--format", "png", "--lens", "pinhole", "--threads", "1")
        straight = check_tables(model + "/pinhole", sights, False)
        check_by_colmap(model + "/pinhole")
        check_tracks(model + "/pinhole", model, straight)
        if {camera[0] for _, _, camera in straight.values()} != {"PINHOLE"}:
            fail("undistorted pictures with a distorted camera")
        check_colours(model + "/recorded", model + "/pinhole", images, straight)
    # Choices, the same bytes with any number of threads, and tags that other programs read.
    run(*export, "--out", "some", "--exposures", "every:3", "--threads", "3")
    run(*export, "--out", "again", "--exposures", "every:3", "--threads", "1")
    made = sorted(os.path.relpath(os.path.join(at, name), "some") for at, _, names in os.walk("some") for name in names)
    if sum(name.endswith(".jpg") for name in made) != 12 or len(made) != 18:
        fail(f"every third exposure: {made}")
    for name in made:
        if open("some/" + name, "rb").read() != open("again/" + name, "rb").read():
            fail(name + " depends on the number of threads")
    row = next(csv.DictReader(open("some/poses.csv")))
    tags = json.loads(run("exiftool", "-j", "-n", "some/" + row["file"]))[0]
    turned = (tags["GPSImgDirection"] - float(row["heading_deg"]) + 180) % 360 - 180
    if abs(tags["GPSLatitude"] - float(row["latitude_deg"])) > 1e-7 or abs(turned) > 0.02:
        fail(f"exiftool reads {tags}")
    if (said := run("exiftool", "-s3", "-validate", "some/" + row["file"]).strip()) != "OK":
        fail(f"exiftool -validate -warning some/{row['file']}: {said}")
    run(*export, "--out", "none", "--from", "1450000010", "--to", "1450000020", status=5)
    run(*export, "--out", "x", "--exposures", "3-", status=2)
    if "the drive has no exposure 6" not in run(*export, "--out", "x", "--exposures", "4-8", status=5):
        fail("exposures that the drive does not have")
    if "the drive has 6 exposures; none is chosen" not in run(*export, "--out", "y", "--exposures", "40", status=5):
        fail("no exposure at all")
    if "some/images has 6 more pictures" not in run(*export, "--out", "some", "--exposures", "0"):
        fail("pictures of an earlier export")
    run(*export, "--out", "brown.yaml", status=4)
    # Poses of a trajectory from post-processing, here 2e-7 rad farther north and turned by 0.01 rad.
    run(HUELINE, "simulate", "brown.yaml", "--out", "sim", "--trajectory", "true.sbet")
    run(sys.executable, SHIFTED, "true.sbet", "shifted.sbet", "2e-7", "0.01")
    said = run(*export, "--out", "post", "--trajectory", "shifted.sbet")
    if "shifted.sbet in place of the POS's solutions" not in said or " 1.2" not in said:
        fail("the trajectory is not compared with the POS: " + said)
    poses = [list(csv.DictReader(open(folder + "/poses.csv"))) for folder in ("brown/recorded", "post")]
    if len(poses[0]) != len(poses[1]):
        fail(f"{len(poses[1])} poses of the trajectory")
    for own, post in zip(*poses):
        north = math.radians(float(post["latitude_deg"]) - float(own["latitude_deg"]))
        turned = math.radians((float(post["heading_deg"]) - float(own["heading_deg"]) + 180) % 360 - 180)
        # The lens lies up to half a metre from the POS and turns with it.
        if abs(north - 2e-7) > 2e-9 or abs(turned - 0.01) > 1e-4:
            fail(f"{post['file']} is {north} rad farther north and turned by {turned} rad")
    if "belong to --trajectory, which is missing" not in run(*export, "--out", "z", "--trajectory-sigma", "true.sbet", status=2):
        fail("accuracies without a trajectory")
    print("images: all as it should be")


with tempfile.TemporaryDirectory() as work:
    HUELINE, PROOF = os.path.abspath(HUELINE), os.path.abspath(PROOF)
    os.chdir(work)
    main()
