"""Runs programs, `vlx-compare sweep` above all, for the project's experiments: the sweep's records are the only ones, and
charts are drawn by chart.py. Python 3 and its standard library only."""

import datetime
import json
import os
import shlex
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BIN = os.path.join(ROOT, "build/release/bin")
ROOM = os.path.join(ROOT, "testdata/scenes/interior.glb")
ROOM_REFERENCE = os.path.join(ROOT, "testdata/references/interior_256.exr")


def _end(command, done):
    sys.exit(f"{os.path.relpath(sys.argv[0])}: exit code {done.returncode} from: {shlex.join(command)}\n{done.stderr}")


def _start(command):
    if not os.access(command[0], os.X_OK) and os.sep in command[0]:
        sys.exit(f"{os.path.relpath(sys.argv[0])}: expected a program, found no {command[0]} (--bin says where they are)")
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run(*command):
    """What the command prints. A failure ends everything, with the command's own words on standard error."""
    command = [str(word) for word in command]
    done = _start(command)
    if done.returncode:
        _end(command, done)
    return done.stdout


def cost(*command):
    """Runs as run(), and says what it took, with all that it started: processor and wall seconds, and the peak memory of its largest
    process in bytes."""
    command = [str(word) for word in command]
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read().decode(errors="replace")
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        _end(command, subprocess.CompletedProcess(command, process.returncode, stderr=said))
    return used.ru_utime + used.ru_stime, time.monotonic() - start, 1024 * used.ru_maxrss


def sweep(programs, scene, folder, *options):
    """Runs `vlx-compare sweep SCENE -o FOLDER OPTION...` without variations and regions; what FOLDER holds is not run again.
    Returns its records (tools/sweep/sweep.h says what is in them), file names with FOLDER: (samplings, images), each in the order
    of seeds, samples a pixel, methods. A method that fails ends everything."""
    command = [str(word) for word in (os.path.join(programs, "vlx-compare"), "sweep", scene, "-o", folder, "--no-vary", "--inspect",
                                      0, "--quiet", "--json", *options)]
    done = _start(command)
    records = [json.loads(line) for line in done.stdout.splitlines()]
    for record in records:
        if record["failure"]:
            sys.exit(f"{os.path.relpath(sys.argv[0])}: {record['command']}: {record['failure']}")
        if record["file"]:
            record["file"] = os.path.join(folder, record["file"])
    if done.returncode:
        _end(command, done)
    return [[r for r in records if r["kind"] == kind] for kind in ("sampling", "image")]


def link(target, name):
    """Gives a file another name, in place of what had it."""
    if os.path.lexists(name):
        os.remove(name)
    os.symlink(os.path.relpath(target, os.path.dirname(name)), name)


def commit(options):
    """Of the code: options.commit, if given."""
    return options.commit or run("git", "-C", ROOT, "log", "-1", "--format=%h", "--", "include", "src", "tools/*.cpp", ":!*.md").strip()


def stamp(options):
    """Date, commit, machine."""
    cpu = next(line.split(":")[1].strip() for line in run("lscpu").splitlines() if line.startswith("Model name"))
    return f"{datetime.date.today()}, commit {commit(options)}, {cpu}, {os.cpu_count()} cores"
