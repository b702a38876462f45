#!/usr/bin/env python3
"""Moves a trajectory (SBET) to the north and turns it, as post-processing would: for tests that see which trajectory was used.

usage: shifted_sbet.py IN OUT LATITUDE_RAD HEADING_RAD
"""
import struct, sys

RECORD = struct.Struct("<17d")
latitude_rad, heading_rad = float(sys.argv[3]), float(sys.argv[4])
with open(sys.argv[1], "rb") as source, open(sys.argv[2], "wb") as out:
    for record in RECORD.iter_unpack(source.read()):
        values = list(record)
        values[1] += latitude_rad
        values[9] += heading_rad
        out.write(RECORD.pack(*values))
