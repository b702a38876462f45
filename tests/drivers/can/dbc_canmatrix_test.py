#!/usr/bin/python3 -W ignore
"""Decodes random frames of every message of DBC files and compares each signal with canmatrix: which signals a frame
has, their bits, their values and the names of their values.

usage: dbc_canmatrix_test.py DBC_DECODE FRAMES FILE.dbc...
Exit status 77: canmatrix (Debian: python3-canmatrix) or the files are not there."""
import contextlib
import io
import os
import random
import subprocess
import sys

try:
    with contextlib.redirect_stderr(io.StringIO()):
        import canmatrix.formats
except ImportError:
    print("canmatrix is not installed: skipped")
    sys.exit(77)


def load(path):
    with open(path, "rb") as file:
        found = canmatrix.formats.load(file, "dbc", dbcImportEncoding="iso-8859-1")
    return list(found.values())[0] if isinstance(found, dict) else found


def expected(frame, data):
    """The signals that canmatrix finds: name -> (raw, value, word)."""
    return {name: (one.raw_value, float(one.phys_value), one.signal.values.get(one.raw_value, ""))
            for name, one in frame.decode(data).items()}


def compare(program, path, frames, seed):
    matrix = load(path)
    rng = random.Random(seed)
    wanted, lines = [], []
    for frame in matrix.frames:
        # Pseudo messages and messages whose signals lie outside are no frames of a bus.
        if frame.size == 0 or frame.size > 64 or frame.name == "VECTOR__INDEPENDENT_SIG_MSG" or not frame.signals:
            continue
        if any(s.is_float for s in frame.signals):
            continue  # canmatrix rounds them in its own way
        for _ in range(frames):
            data = bytes(rng.randrange(256) for _ in range(frame.size))
            try:
                want = expected(frame, data)
            except Exception:  # canmatrix refuses signals that do not fit into their message
                continue
            wanted.append((frame, want))
            lines.append("%d %d %s" % (frame.arbitration_id.id, frame.arbitration_id.extended, data.hex()))
    done = subprocess.run([program, path], input="\n".join(lines) + "\n", capture_output=True, encoding="iso-8859-1")
    answers = done.stdout.split("\n")[:len(lines)]
    assert len(answers) == len(lines), done.stderr
    signals = wrong = 0
    for (frame, want), answer in zip(wanted, answers):
        got = {}
        for field in filter(None, answer.split("\x1f")):
            name, raw, value, word = field.split("\t")
            got[name] = (int(raw), float(value), word)
        for name in sorted(set(want) | set(got)):
            signals += 1
            a, b = want.get(name), got.get(name)
            same = a and b and a[0] == b[0] and abs(a[1] - b[1]) <= 1e-9 * max(1, abs(a[1])) and str(a[2]) == b[2]
            if not same:
                wrong += 1
                if wrong <= 5:
                    print("%s: %s.%s: canmatrix %s, here %s" % (path, frame.name, name, a, b))
    print("%s: %d messages, %d frames, %d signals, %d differ" %
          (os.path.basename(path), len(matrix.frames), len(lines), signals, wrong))
    return signals, wrong


def main():
    program, frames, paths = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    paths = [path for path in paths if os.path.exists(path)]
    if not paths:
        print("no DBC file is there: skipped")
        return 77
    total = [compare(program, path, frames, 7) for path in paths]
    if min(signals for signals, _ in total) == 0:
        print("nothing was compared")
        return 1
    return 1 if sum(wrong for _, wrong in total) else 0


if __name__ == "__main__":
    sys.exit(main())
