"""Frames: their list, their names, and which of a shot add to each other (tools/frames.h, sequence.h)."""

import os
import re

from .log import Usage


def parse(text):
    """'1-3,7,10-20x5': numbers from 0, in this order, each once."""
    numbers = []
    for part in text.split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+)(?:x(\d+))?)?", part.strip())
        first, last, step = (int(number or 0) for number in match.groups()) if match else (0, 0, 0)
        if not match or (match[2] and last < first) or (match[3] and step == 0) or max(first, last) > 999999:
            raise Usage(f"--frames: expected frames such as 1-100x2,150, found '{text}'")
        numbers += range(first, (last if match[2] else first) + 1, step or 1)
    return list(dict.fromkeys(numbers))


def has_place(name):
    return "#" in os.path.basename(name)


def name_of(name, frame):
    """Each run of # in the last part replaced by the frame's number, of at least as many digits."""
    folder, last = os.path.split(name)
    return os.path.join(folder, re.sub("#+", lambda run: f"{frame:0{len(run[0])}}", last))


def around(frame, temporal, exists):
    """Those whose data vlx-krige --temporal uses for `frame`: `temporal` on either side, near the ends of a shot more on
    the other."""
    def extend(count, step, most):
        while count < most and frame + step * (count + 1) >= 0 and exists(frame + step * (count + 1)):
            count += 1
        return count
    before = extend(0, -1, temporal)
    after = extend(0, 1, 2 * temporal - before)
    before = extend(before, -1, 2 * temporal - after)
    return range(frame - before, frame + after + 1)
