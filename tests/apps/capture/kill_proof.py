#!/usr/bin/env python3
"""Kills captures at random moments, with SIGKILL, and says how much of the time before is missing in their recordings.

usage: kill_proof.py HUELINE SOURCE_DIR [ROUNDS [SEED]]

The devices go on sending, so data came until the kill. Printed, not asserted: a computer that is busy elsewhere is late. Exit status 1 if a
recording cannot be recovered.
"""

import pathlib
import random
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from recorded_messages import messages


def main():
    hueline, source = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    chance = random.Random(int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    lost = []
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        devices = [hueline, "simulate", source / "tests/scenarios/short.yaml", "--out", "sim", "--pps-socket", work / "pps.sock"]
        quiet = dict(cwd=work, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        subprocess.run([*devices, "--write-rig", "rig.yaml"], check=True, **quiet)
        while len(lost) < rounds:
            played = subprocess.Popen([*devices, "--play"], **quiet)
            drive = work / f"drive{len(lost)}"
            capture = subprocess.Popen([hueline, "capture", "rig.yaml", "--out", drive], **quiet)
            time.sleep(chance.uniform(4, 8))
            capture.kill()
            killed = time.clock_gettime(time.CLOCK_MONOTONIC_RAW)
            capture.wait()
            played.kill()
            played.wait()
            whole = work / "whole.mcap"
            whole.unlink(missing_ok=True)
            if subprocess.run([hueline, "recover", drive / "drive.mcap", "--out", whole], **quiet).returncode != 0:
                sys.exit(f"FAILED: round {len(lost)} is not recovered")
            lost.append(killed - max(message[2] for message in messages(whole)))
    lost.sort()
    print(f"{rounds} kills: the last packet came {lost[len(lost) // 2] * 1e3:.0f} ms before (median), {lost[-1] * 1e3:.0f} ms at most")


main()
