"""What a run says: as the other programs of Variolux do (tools/progress_bar.h, tools/tool_main.h)."""

import json
import math
import resource
import shutil
import sys
import threading
import time

DONE, FAILED, BAD_USAGE, PASSED = 0, 1, 2, 3  # exit codes


class Failure(Exception):
    """A file, the disk, Blender: exit code 1."""


class Usage(Exception):
    """The command line: exit code 2."""


def counted(number, thing):
    """1 file, 2 files."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def duration(seconds):
    """12 s, 3 min 05 s, 2 h 07 min."""
    whole = math.ceil(max(seconds, 0))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02} min"


def peak_megabytes():
    """The most memory that this process or one that it ran and that has ended has had, in 10^6 bytes."""
    return max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) * 1024e-6


class Log:
    """Messages and progress, from any thread. format: text, json or openjd."""

    def __init__(self, form="text", quiet=False):
        self.form, self.quiet = form, quiet
        self.lock = threading.RLock()
        self.bar = not quiet and form == "text" and sys.stderr.isatty()
        self.drawn = self.visible = 0
        self.start = None
        self.fraction = 0.0

    def record(self, event, **values):
        """A line of JSON on standard error, with --log json only."""
        if self.form == "json":
            with self.lock:
                print(json.dumps({"event": event, **values}, ensure_ascii=False, separators=(",", ":")), file=sys.stderr, flush=True)

    def say(self, text):
        if not self.quiet:
            self.warn(text)

    def warn(self, text):
        """Also when --quiet was given."""
        with self.lock:
            self.erase()
            if self.form == "json":
                self.record("message", message=text)
            else:
                print(text, file=sys.stderr, flush=True)

    def erase(self):
        if self.bar and self.visible:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
            self.visible = 0

    def progress(self, task, fraction):
        """`fraction` of the whole is done. Never goes back; the time left counts from the first call."""
        with self.lock:
            now = time.monotonic()
            self.start = self.start or now
            last = fraction >= 1 > self.fraction
            self.fraction = max(self.fraction, min(fraction, 1.0))
            if self.drawn and now - self.drawn < (0.1 if self.form == "text" else 1) and not last:
                return
            seconds = now - self.start
            left = seconds * (1 - self.fraction) / self.fraction if self.fraction > 0 and seconds >= 1 else None
            if self.form == "json":
                self.record("progress", task=task, fraction=round(self.fraction, 4), seconds=round(seconds, 2),
                            secondsLeft=0.0 if self.fraction >= 1 else None if left is None else round(left, 1),
                            peakMemoryMB=round(peak_megabytes()))
            elif self.form == "openjd":
                print(f"openjd_status: {task}\nopenjd_progress: {self.fraction * 100:.1f}", flush=True)
            elif self.bar:
                self.draw(task, left)
            self.drawn = now

    def draw(self, task, left):
        tail = f"{int(self.fraction * 100):3} %" + (f", {duration(left)} left" if left is not None and self.fraction < 1 else "")
        columns = shutil.get_terminal_size().columns - 1
        room = min(columns - len(task) - len(tail) - 5, 40)
        filled = round(self.fraction * room)
        bar = f" [{'#' * filled}{'.' * (room - filled)}] " if room >= 5 else ""
        print("\r" + f"{task} {bar}{tail}"[:columns] + "\033[K", end="", file=sys.stderr, flush=True)
        self.visible = 1

    def end(self, code, message=""):
        """The last words of a run. `message`: what went wrong."""
        with self.lock:
            self.erase()
            if message and self.form != "json":
                print(f"vlx-blender: {message}", file=sys.stderr, flush=True)
            if message and self.form == "openjd":
                print("openjd_fail: " + " ".join(message.split("\n")), flush=True)
            values = {"message": message} if message else {}
            self.record("end", exitCode=code, peakMemoryMB=round(peak_megabytes()), **values)
