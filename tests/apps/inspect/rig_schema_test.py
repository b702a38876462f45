#!/usr/bin/env python3
"""The JSON schema that `hueline rig schema` prints, held by an independent validator against rigs that are right and rigs that are wrong.

usage: rig_schema_test.py PROGRAM SOURCE
"""
import copy
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import jsonschema
import yaml

program, source = sys.argv[1], pathlib.Path(sys.argv[2])


class Loader(yaml.SafeLoader):
    """YAML 1.2's numbers: PyYAML takes 4e-06 for a text."""


Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+0123456789."))

schema = json.loads(subprocess.run([program, "rig", "schema"], check=True, capture_output=True).stdout)
jsonschema.Draft7Validator.check_schema(schema)
validator = jsonschema.Draft7Validator(schema)


def read(text):
    return yaml.load(text, Loader=Loader)


def program_takes(rig):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        json.dump(rig, file)  # JSON is YAML
        file.flush()
        return subprocess.run([program, "inspect", file.name], capture_output=True).returncode == 0


rigs = {str(path): path.read_text() for path in (source / "config/rigs").glob("*.yaml")}
for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", (source / "docs/rig.md").read_text(), re.S)):
    rigs[f"docs/rig.md, example {number + 1}"] = text
# Whole rigs that tests write in here-documents.
for path in (source / "tests").rglob("*.sh"):
    for number, text in enumerate(re.findall(r"<<'?(?:EOF|END|RIG|YAML)'?[^\n]*\n(rig:.*?)\n(?:EOF|END|RIG|YAML)\n", path.read_text(), re.S)):
        if "$" not in text:
            rigs[f"{path}, {number + 1}"] = text
assert len(rigs) >= 12, f"only {len(rigs)} rigs were found"
wrong = 0
for name, text in rigs.items():
    rig = read(text)
    for error in validator.iter_errors(rig):
        print(f"{name}: {'/'.join(map(str, error.absolute_path))}: {error.message}")
        wrong += 1
    if not program_takes(rig):
        print(f"{name}: the program does not take it")
        wrong += 1

good = {
    "rig": "r",
    "sensors": [
        {"name": "pos", "driver": "novatel", "serial": {"device": "/dev/ttyS0", "baud": 460800}, "logs": {"ins_rate_hz": 100}},
        {"name": "laser", "driver": "velodyne", "model": "VLP-16", "udp": {"ports": [2368]},
         "T_body_scanner": {"position_m": [0, 0, 2], "rotation_deg": [0, 0, 0]}},
        {"name": "camera", "driver": "genicam", "serial": "1", "pixel_format": "Mono8", "width": 64, "height": 64, "exposure_us": 1000, "event_input": 1},
        {"name": "wheel", "driver": "wheel", "can": {"interface": "can0"}, "messages": [{"id": 5, "speeds": [{"unit": "km/h", "start_bit": 0, "bits": 8}]}]},
    ],
    "head": {
        "T_body_head": {"position_m": [0, 0, 2], "quaternion_wxyz": [1, 0, 0, 0]},
        "panorama": {"width": 800, "height": 400, "stitching_radius_m": 20},
        "lenses": [{"name": "a", "camera": "camera", "offset_px": [0, 0], "width": 64, "height": 64, "model": "brown", "focal_px": [60, 60],
                    "principal_point_px": [31, 31], "distortion": [], "T_head_lens": {"position_m": [0, 0, 0], "rotation_deg": [0, 0, 0]}}],
    },
    "colouring": {"method": "lens"},
}
assert validator.is_valid(good), list(validator.iter_errors(good))
assert program_takes(good)

DELETE = object()
changes = [
    (["rig"], DELETE),
    (["colour"], 1),
    (["sensors"], []),
    (["sensors", 0, "driver"], "novattel"),
    (["sensors", 0, "driver"], DELETE),
    (["sensors", 0, "name"], "Pos"),
    (["sensors", 0, "serial", "baud"], "fast"),
    (["sensors", 0, "serial", "baud"], 12000001),
    (["sensors", 0, "serial"], DELETE),
    (["sensors", 0, "tcp"], {"host": "h", "port": 3001}),
    (["sensors", 0, "logs", "mark_inputs"], [5]),
    (["sensors", 0, "min_range_m"], 1),
    (["sensors", 1, "model"], "VLP-32"),
    (["sensors", 1, "udp", "ports"], []),
    (["sensors", 1, "udp", "ports"], [70000]),
    (["sensors", 1, "udp", "bind_address"], "localhost"),
    (["sensors", 1, "min_range_m"], -1),
    (["sensors", 1, "azimuth_begin_deg"], 360),
    (["sensors", 1, "detects_lost"], "perhaps"),
    (["sensors", 1, "T_body_scanner"], DELETE),
    (["sensors", 1, "T_body_scanner", "rotation_deg"], [0, 0]),
    (["sensors", 1, "T_body_scanner", "rotation_matrix"], [1, 0, 0, 0, 1, 0, 0, 0, 1]),
    (["sensors", 2, "width"], 0),
    (["sensors", 2, "width"], 64.5),
    (["sensors", 2, "event_input"], 5),
    (["sensors", 2, "payload"], "raw"),
    (["sensors", 3, "messages", 0, "speeds", 0, "bits"], 65),
    (["sensors", 3, "messages", 0, "checksum"], {"kind": "xor"}),
    (["head", "lenses"], []),
    (["head", "lenses", 0, "focal_px"], [60, 60, 60]),
    (["head", "lenses", 0, "masks"], [{"polygon": [0, 0, 1, 0, 1, 1]}]),
    (["colouring", "neighbours"], 16),
    (["cloud"], {"crs": "EPSG:"}),
    (["time"], {"hold_s": 0.5}),
]
for path, value in changes:
    rig = copy.deepcopy(good)
    place = rig
    for step in path[:-1]:
        place = place[step]
    if value is DELETE:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    said = f"{'/'.join(map(str, path))} {'left out' if value is DELETE else '= ' + json.dumps(value)}"
    if validator.is_valid(rig):
        print(f"the schema takes a wrong rig: {said}")
        wrong += 1
    if program_takes(rig):
        print(f"the program takes a wrong rig: {said}")
        wrong += 1
print(f"{len(rigs)} rigs, {len(changes)} wrong ones, {wrong} complaints")
sys.exit(1 if wrong else 0)
