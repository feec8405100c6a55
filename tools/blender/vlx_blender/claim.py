"""Pictures that a run is at work on, so that another run finds them taken: a locked file in the run's hidden folder. The lock goes
with the run, however that ends; its file with the folder, or not at all."""

import contextlib
import fcntl
import glob
import json
import os
import socket

from .log import Failure

FOLDER = ".vlx-blender-"  # what the names of runs' hidden folders begin with
FILE = "run"


@contextlib.contextmanager
def alone_in(folder):
    """No two runs look around and lock at the same time. Where folders cannot be locked (NFS), they may refuse each other."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def others(folder):
    """What the runs that live say of themselves."""
    for path in sorted(glob.glob(os.path.join(glob.escape(folder), FOLDER + "*", FILE))):
        with contextlib.suppress(OSError, ValueError), open(path, encoding="utf-8") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                yield json.load(file)


def claim(temporary, pictures):
    """Takes the pictures for the run of that hidden folder, which lies beside them, as long as the file that is returned is open."""
    folder = os.path.dirname(temporary)
    names = [os.path.basename(picture) for picture in pictures]
    with alone_in(folder):
        for other in others(folder):
            taken = [picture for picture, name in zip(pictures, names) if name in other["pictures"]]
            if taken:
                more = f" and {len(taken) - 1} more" if len(taken) > 1 else ""
                raise Failure(f"{taken[0]}{more}: expected no other vlx-blender at work on it, found process {other['process']} on "
                              f"{other['host']}: wait for its end, or end it; other --frames, or another --output, go beside it")
        file = open(os.path.join(temporary, FILE), "w", encoding="utf-8")
        fcntl.flock(file, fcntl.LOCK_EX)
        json.dump({"process": os.getpid(), "host": socket.gethostname(), "pictures": names}, file)
        file.flush()
    return file
