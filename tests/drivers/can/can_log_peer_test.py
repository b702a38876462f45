#!/usr/bin/python3 -W ignore
"""Reads logs (BLF, TRC) beside python-can: ones of random frames that python-can writes, and the files that are given.

usage: can_log_peer_test.py CAN_LOG_PRINT FRAMES FILE.blf...
Exit status 77: python-can (Debian: python3-can) is not there."""
import os
import random
import subprocess
import sys
import tempfile

try:
    import can
    from can.io.blf import BLFReader, BLFWriter
    from can.io.trc import TRCReader, TRCWriter
except ImportError:
    print("python-can is not installed: skipped")
    sys.exit(77)


def random_log(path, count, seed):
    rng = random.Random(seed)
    is_trace = path.endswith(".trc")  # python-can writes neither CAN FD, nor errors, nor requests into it
    writer = TRCWriter(path) if is_trace else BLFWriter(path, channel=2)
    time = 1_700_000_000.0
    for _ in range(count):
        time += rng.choice([0.0, 1e-5, 0.001, 0.37])
        extended, fd = rng.random() < 0.3, not is_trace and rng.random() < 0.3
        size = rng.choice([0, 1, 7, 8, 12, 20, 48, 64] if fd else range(9))
        kind = 1 if is_trace else rng.random()
        error, remote = kind < 0.05, not fd and 0.05 <= kind < 0.1
        data = bytes(rng.randrange(256) for _ in range(0 if remote else 8 if error else size))
        writer.on_message_received(can.Message(
            timestamp=time, arbitration_id=rng.randrange(1 << (29 if extended else 11)), is_extended_id=extended,
            is_remote_frame=remote, is_error_frame=error, is_fd=fd and not error, is_rx=rng.random() < 0.5,
            channel=rng.choice([0, 1, 6]), data=data, dlc=size if remote else len(data)))
    writer.stop()


def by_peer(path):
    is_trace = path.endswith(".trc")
    reader = TRCReader(path) if is_trace else BLFReader(path)
    start = 0 if is_trace else None  # a trace's times are those since its beginning
    out = []
    for one in reader:
        kind = ""
        if one.is_error_frame:
            kind = "e"
        else:
            kind += "x" if one.is_extended_id or one.arbitration_id > 0x7FF else ""
            kind += "r" if one.is_remote_frame else ""
            kind += "f" if one.is_fd else ""
            kind += "" if one.is_rx else "l"
        data = "" if one.is_error_frame or one.is_remote_frame else bytes(one.data).hex()
        channel = one.channel if is_trace else (one.channel + 1) & 0xFF
        out.append((one.timestamp - (reader.start_timestamp if start is None else start), channel,
                    0 if one.is_error_frame else one.arbitration_id, kind or "-", data))
    return out


def by_hueline(program, path):
    done = subprocess.run([program, path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    out = []
    for line in done.stdout.splitlines():
        time, channel, number, kind, *data = line.split(" ")
        out.append((int(time) * 1e-9, int(channel), int(number, 16), kind, data[0] if data else ""))
    return out


def main():
    program, count = sys.argv[1], int(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        made = [os.path.join(folder, name) for name in ("random.blf", "random.trc")]
        for path in made:
            random_log(path, count, 24)
        for path in made + sys.argv[3:]:
            want, got = by_peer(path), by_hueline(program, path)
            assert want and len(want) == len(got), f"{path}: {len(got)} frames, python-can reads {len(want)}"
            assert path not in made or len(want) == count, f"{len(want)} of {count} frames were written"
            for i, (w, g) in enumerate(zip(want, got)):
                # python-can keeps times as floating-point seconds since 1970: 0.2 us today.
                assert w[1:] == g[1:] and abs(w[0] - g[0]) < 1e-6, f"{path}, frame {i}: {g}, python-can reads {w}"
            print(f"{os.path.basename(path)}: {len(got)} frames as python-can reads them")


main()
