"""Programs that a run starts, and what remains of them when it ends: nothing."""

import json
import os
import shutil
import signal
import subprocess
import threading

from .log import Failure


class Children:
    """Processes that run, each a group of its own, so that Ctrl-C reaches them through us alone."""

    def __init__(self):
        self.lock = threading.Lock()
        self.running = set()
        self.closed = False

    def start(self, command, **options):
        with self.lock:
            if self.closed:
                raise Failure("ended")
            try:
                # Signals stay as Python has them: at a file size limit a message, as on a full disk, no signal.
                child = subprocess.Popen(command, start_new_session=True, restore_signals=False, **options)
            except OSError as error:
                raise Failure(f"{command[0]}: cannot be started: {error.strerror}") from None
            self.running.add(child)
            return child

    def done(self, child):
        with self.lock:
            self.running.discard(child)

    def end(self):
        """Ends those that run, and what they started. They are asked first: each removes its unfinished files."""
        with self.lock:
            self.closed = True
            running = list(self.running)
        for how, patience in ((signal.SIGTERM, 5), (signal.SIGKILL, None)):
            for child in running:
                try:
                    os.killpg(child.pid, how)
                except ProcessLookupError:
                    pass
            for child in running:
                try:
                    child.wait(patience)
                except subprocess.TimeoutExpired:
                    pass


class Programs:
    """vlx-pack and vlx-krige: beside vlx-blender, else those of the source tree's build, else where PATH finds them."""

    def __init__(self, folders, children):
        self.children = children
        self.paths = {name: self.find(name, folders) for name in ("vlx-pack", "vlx-krige")}

    @staticmethod
    def find(name, folders):
        for folder in folders:
            path = os.path.join(folder, name)
            if os.access(path, os.X_OK):
                return path
        found = shutil.which(name)
        if not found:
            raise Failure(f"expected {name} beside vlx-blender or in PATH, found none")
        return found

    def run(self, name, *arguments):
        """Exit code, what it printed on standard output, its messages, and what it says of its failure."""
        child = self.children.start([self.paths[name], *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE, text=True, errors="replace")
        try:
            out, err = child.communicate()
        finally:
            self.children.done(child)
        messages, failure, plain = [], "", []
        for line in err.splitlines():
            try:
                record = json.loads(line)
                event, message = record.get("event"), record.get("message", "")
            except (ValueError, AttributeError):
                plain.append(line)
                continue
            if event == "message":
                messages.append(message)
            elif event == "end":
                failure = message
        if child.returncode < 0:
            failure = failure or f"{name} was ended by signal {-child.returncode}"
        return child.returncode, out, messages, failure or "\n".join(plain)

    def version(self):
        code, out, _, failure = self.run("vlx-krige", "--version")
        if code != 0:
            raise Failure(f"{self.paths['vlx-krige']}: cannot be run: {failure}")
        return out.strip()
