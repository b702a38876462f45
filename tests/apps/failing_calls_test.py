#!/usr/bin/env python3
"""A command of which one call of the kernel about files fails, for every call that it makes.

usage: failing_calls_test.py HUELINE IMAGE_PROOF SOURCE_DIR [EVERY [OUTPUT...]]

strace lets the call fail with "Input/output error". What must hold of each run:
  - exit status 0 means that all outputs are those of a run without a failure, byte by byte;
  - otherwise a sentence says why. No signal ends the program, and what it reads is as before.
EVERY 1 lets every call fail; 16, every sixteenth. OUTPUT: only the commands that write it.
"""

import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

CALLS = ("read,readv,pread64,openat,lseek,fstat,newfstatat,statx,getdents64,close,write,writev,pwrite64,ftruncate,fallocate,fsync,fdatasync,"
         "rename,renameat,renameat2,unlink,unlinkat,mkdir,mkdirat,symlink,symlinkat,link,linkat,chmod,fchmod")


def digests(folder):
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.rglob("*")) if path.is_file()}


def traced(command, work, options=()):
    """Runs the command; returns it and its calls, one list for each of its threads, that of the main one first."""
    trace = work / "trace.txt"
    run = subprocess.run(["strace", "-f", "-qq", "-y", "-o", trace, "-e", f"trace={CALLS}", *options, *command],
                         cwd=work, capture_output=True, text=True, timeout=300)
    threads = {}
    for line in trace.read_text(errors="replace").splitlines():
        thread, _, call = line.partition(" ")
        if not call.lstrip().startswith(("<...", "---", "+++")):
            threads.setdefault(thread, []).append(call.strip())
    return run, list(threads.values())


def failures(threads, every):
    """Which calls to let fail, (name, number): strace counts the calls of a name, in each thread. What the loader does before the program
    begins is not ours. Of each name the last one is among them."""
    main = threads[0]
    begin = next(i for i, call in enumerate(main) if "drives/" in call)
    out = []
    for name in CALLS.split(","):
        count = max(sum(1 for call in calls if call.startswith(name + "(")) for calls in threads)
        before = sum(1 for call in main[:begin] if call.startswith(name + "("))
        out += [(name, number) for number in range(before + 1, count + 1) if number == count or (number - before) % every == 0]
    return out


class Command:
    """A command, the folder or file that it writes, and what it reads."""

    def __init__(self, name, words, work, out):
        self.name, self.words, self.work, self.out = name, words, work, work / out

    def clean(self):
        if self.out.is_dir():
            shutil.rmtree(self.out)
        self.out.unlink(missing_ok=True)

    def outputs(self):
        if self.out.is_dir():
            return digests(self.out)
        return {self.out.name: hashlib.sha256(self.out.read_bytes()).hexdigest()} if self.out.exists() else {}

    def fail_every(self, every):
        self.clean()
        run, threads = traced(self.words, self.work)
        assert run.returncode == 0, f"{self.name}: {run.stdout}{run.stderr}"
        good, inputs = self.outputs(), digests(self.work / "drives")
        assert good, f"{self.name} has no output"
        failed = unchanged = 0
        faults = []
        chosen = failures(threads, every)
        for name, number in chosen:
            self.clean()
            run, threads = traced(self.words, self.work, ["-e", f"inject={name}:error=EIO:when={number}"])
            hit = [call for calls in threads for call in calls if "(INJECTED)" in call]
            if not hit:
                continue
            where = f"{self.name}: {'; '.join(hit)}: status {run.returncode}"
            if run.returncode == 0:
                unchanged += 1
                if self.outputs() != good:
                    faults.append(f"{where}, but the output differs: {run.stderr}")
            else:
                failed += 1
                is_mute = any(re.match(r"writev?\(2,", call) for call in hit)
                if run.returncode < 0 or run.returncode >= 100:
                    faults.append(f"{where}: {run.stderr}")
                elif not run.stderr.strip() and not is_mute:
                    faults.append(f"{where}, and nothing is said")
            if digests(self.work / "drives") != inputs:
                faults.append(f"{where}: its input has changed")
                break
        if failed == 0:
            faults.append(f"{self.name}: no call that failed was told: strace let none fail")
        print(f"{self.name}: {failed + unchanged} of {len(chosen)} calls failed: {failed} times the command said so, "
              f"{unchanged} times its output was the same", flush=True)
        return faults


def main():
    hueline, proof, source = map(pathlib.Path, sys.argv[1:4])
    every = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    only = sys.argv[5:]
    if shutil.which("strace") is None or subprocess.run(["strace", "-qq", "-o", "/dev/null", "true"], stderr=subprocess.DEVNULL).returncode != 0:
        print("SKIPPED: strace is not installed, or may not watch a program here")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        subprocess.run(["bash", "-euc", f'hueline={hueline}; proof={proof}; source {source}/tests/apps/program.sh; '
                        f'source {source}/tests/apps/fleet/drives.sh; make_drives 1'], cwd=work, check=True)
        (work / "out").mkdir()
        subprocess.run([hueline, "replay", "drives/1", "--out", "drives/made", "--no-feed"], cwd=work, check=True, stdout=subprocess.DEVNULL)
        shutil.copy(work / "drives/1/drive.mcap", work / "drives/made")
        command = lambda out, *words: Command(out, [hueline, *words, "--out", f"out/{out}"], work, f"out/{out}")
        commands = [
            command("whole.mcap", "recover", "drives/1/drive.mcap"),
            command("part.mcap", "cut", "drives/1"),
            command("laser.pcap", "extract", "drives/1/drive.mcap", "--sensor", "laser"),
            command("pos.gps", "extract", "drives/1/drive.mcap", "--sensor", "pos"),
            command("again", "replay", "drives/1", "--no-feed", "--threads", "1"),
            command("cloud.laz", "export", "drives/made", "--threads", "1"),
            command("cloud.copc.laz", "export", "drives/made", "--profile", "copc", "--threads", "1"),
            command("tiles", "export", "drives/made", "--split", "tile:20m", "--threads", "1"),
            command("cloud.ply", "export", "drives/made", "--profile", "ply"),
            command("cloud.e57", "export", "drives/made", "--profile", "e57"),
            command("images", "export", "drives/made", "--profile", "images", "--exposures", "1-2"),
            command("drive.sbet", "export", "drives/made", "--profile", "trajectory"),
            command("drive.csv", "export", "drives/made", "--profile", "trajectory"),
            command("drive.kml", "export", "drives/made", "--profile", "trajectory"),
            command("panorama", "panorama", "drives/made", "--exposures", "1", "--size", "256x128"),
        ]
        faults = [fault for command in commands if not only or command.name in only for fault in command.fail_every(every)]
    if faults:
        print("FAILED:", *faults, sep="\n")
        sys.exit(1)


main()
