"""Blender in the background, which renders what it is asked for (render_server.py)."""

import collections
import json
import os
import re
import shutil
import subprocess
import threading

from .log import Failure

SERVER = os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(__file__))), "render_server.py")
OLDEST = (3, 4)
MAGIC = (b"BLENDER", b"\x1f\x8b", b"\x28\xb5\x2f\xfd")  # as it is, gzip, Zstandard


def check_scene_file(path):
    """Blender would render an empty scene instead."""
    if os.path.isdir(path):
        raise Failure(f"{path}: expected a Blender file, found a folder")
    try:
        with open(path, "rb") as file:
            start = file.read(8)
    except OSError as error:
        raise Failure(f"{path}: cannot be read: {error.strerror}") from None
    if not start.startswith(MAGIC):
        raise Failure(f"{path}: expected a Blender file (.blend), found something else")


class Blender:
    """One Blender with one scene. `sampled(fraction)` is told how far the image that is being rendered is."""

    def __init__(self, program, scene, wish, children, temporary, threads=0, sampled=lambda fraction: None):
        self.scene, self.children, self.sampled = scene, children, sampled
        self.said = collections.deque(maxlen=200)  # Blender's last lines
        self.unwritten = ""  # what it says of a file that it could not write, and finishes all the same
        self.named = False  # it has said that it is Blender
        self.heard = threading.Semaphore(0)  # all that it said of an image
        found = shutil.which(program)
        if not found:
            raise Failure(f"{program}: expected Blender 3.4 or later, found no such program (--blender PATH)")
        self.program = program
        command = [found, "-b", *(["--threads", str(threads)] if threads else []), os.path.abspath(scene),
                   "--python", SERVER, "--", json.dumps(wish)]
        self.process = children.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                      errors="replace", env={**os.environ, "TMPDIR": temporary})
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()
        self.about = self.answer()
        self.check_opened()

    def listen(self):
        for line in self.process.stderr:
            if line == "vlx\n":
                self.heard.release()
                continue
            self.said.append(line.rstrip())
            if re.match(r"OpenEXR-\w+: ERROR", line):
                self.unwritten = line.rstrip()
            sample = re.search(r"\| Sample (\d+)/(\d+)", line)
            if sample and int(sample[2]):
                self.sampled(int(sample[1]) / int(sample[2]))

    def answer(self):
        for line in self.process.stdout:
            if not line.startswith("vlx "):
                self.named = self.named or line.startswith("Blender ")
                self.said.append(line.rstrip())
                continue
            self.named = True
            values = json.loads(line[4:])
            if "error" in values:
                self.fail(re.sub(r"^Error: ", "", values["error"]))
            return values
        code = self.process.wait()
        self.listener.join(2)
        self.children.done(self.process)
        if code >= 0 and not self.named:
            raise Failure("\n".join([f"{self.program}: expected Blender 3.4 or later, found a program that ended (exit code {code}) without "
                                     "a word of Blender's (--blender PATH)", *(f"  it said: {line}" for line in [*self.said][-3:])]))
        self.fail(f"Blender was ended by signal {-code}" if code < 0 else f"Blender ended (exit code {code})")

    def fail(self, what):
        """With Blender's own words, unless they are the same."""
        own = [line.strip() for line in self.said if re.search(r"error|cannot|failed|no space|not enough", line, re.I)]
        own = [line for line in dict.fromkeys(own) if what not in line and line not in what][-3:]
        raise Failure("\n".join([f"{self.scene}: {what}", *(f"  Blender: {line}" for line in own)]))

    def check_opened(self):
        about = self.about
        if tuple(about["version"][:2]) < OLDEST:
            raise Failure(f"{self.program}: expected Blender 3.4 or later, found {about['blender']} (--blender PATH)")
        if os.path.realpath(about["file"] or ".") != os.path.realpath(self.scene):
            self.fail(f"cannot be opened by Blender {about['blender']}")

    def render(self, frame, sample, path, note):
        """One image, whose first sample has the number `sample`, with the text `note` in its header."""
        request = {"frame": frame, "sample": sample, "path": path, "note": note}
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # the answer says why
        self.answer()
        while not self.heard.acquire(timeout=1) and self.listener.is_alive():
            pass
        if self.unwritten:
            self.fail(self.unwritten)

    def close(self):
        self.process.stdin.close()
        self.process.wait()
        self.children.done(self.process)
