"""A shot: its frames are rendered one after the other, and packed and kriged while the next ones render."""

import collections
import dataclasses
import json
import math
import os
import shlex
import shutil
import threading

from . import frames
from .log import Failure

AHEAD = 2            # frames that may wait for kriging, so that the disk does not fill with them
ERROR_FALLS = 0.6    # as samples ** -0.6, measured over scenes
MOST_AT_ONCE = 3     # times as many images as there are, in one step towards the wanted error


@dataclasses.dataclass
class Options:
    output: str
    images: int
    samples: int
    temporal: int
    target: float           # 0: none
    most_images: int
    keep: str               # a folder for dumps, or empty
    keeping: str            # a hidden folder there, for what is not complete
    krige: list             # options of vlx-krige
    first_sample: int       # number of the first image's first sample


class Frame:
    """What is there of a frame."""

    def __init__(self, number):
        self.number = number
        self.asked = self.images = 0  # images that are to be rendered, that are there
        self.packed = self.kriged = False


class Shot:
    """`wanted`: frames whose picture is asked for. `rendered`: these, and those of the shot that add to them."""

    def __init__(self, options, shot, wanted, notes, blender, programs, log, temporary):
        self.options, self.blender, self.programs, self.log, self.temporary = options, blender, programs, log, temporary
        members = set(shot)
        self.windows = {f: frames.around(f, options.temporal, members.__contains__) if options.temporal else range(f, f + 1)
                        for f in wanted}
        needed = {f for window in self.windows.values() for f in window}
        self.frames = {f: Frame(f) for f in shot if f in needed}
        self.notes = notes
        self.changed = threading.Condition()
        self.to_pack = collections.deque()
        self.more = collections.deque()  # frames whose error is not low enough yet
        self.failure = None
        self.busy = self.closing = False
        self.said = set()
        self.radiance = []  # vlx-krige's options for light groups and contributions, as vlx-pack finds them
        self.missed = []  # frames whose error stayed above the wanted one
        self.images_done = 0
        self.task, self.part = "rendering", 0.0

    # What is where. #### stands for the frame in what vlx-krige reads.

    def image(self, frame, i):
        return os.path.join(self.temporary, f"image_{frame:04}_{i:04}.exr")

    def dumps(self):
        return os.path.join(self.temporary, "samples_####.exr")

    def pictures(self):
        return os.path.join(self.temporary, "kriged_####.exr")

    def templates(self):
        """All that is not light: the mean of the images' other passes."""
        return os.path.join(self.temporary, "passes_####.exr")

    # Progress: an image and a frame's kriging count the same.

    def told(self):
        images = sum(frame.asked for frame in self.frames.values())
        kriged = sum(f.kriged for f in self.frames.values())
        if images:
            self.log.progress(self.task, (self.images_done + self.part + kriged) / (images + len(self.windows)))

    def sampled(self, part):
        with self.changed:
            self.part = min(part, 0.99)
            self.told()

    # Rendering, in the thread that calls.

    def run(self):
        for frame in self.frames.values():
            frame.asked = self.options.images
        kriging = threading.Thread(target=self.krige_all, daemon=True)
        kriging.start()
        waiting = collections.deque(self.frames.values())
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.failure or self.more or self.idle() or (waiting and len(self.to_pack) < AHEAD))
                if self.failure:
                    raise self.failure
                frame = self.more.popleft() if self.more else waiting.popleft() if waiting else None
            if frame is None:
                break
            self.render(frame)
        with self.changed:
            self.closing = True
            self.changed.notify_all()
        kriging.join()

    def idle(self):
        return not self.to_pack and not self.busy

    def render(self, frame):
        while frame.images < frame.asked:
            i = frame.images
            with self.changed:
                self.task = f"frame {frame.number}, image {i + 1} of {frame.asked}"
                self.part = 0.0
                self.told()
            self.blender.render(frame.number, self.options.first_sample + i * self.options.samples, self.image(frame.number, i),
                                self.notes[frame.number])
            with self.changed:
                if self.failure:
                    raise self.failure
                frame.images += 1
                self.images_done += 1
                self.part = 0.0
                self.told()
        with self.changed:
            self.to_pack.append(frame)
            self.changed.notify_all()

    # Packing and kriging, in a thread of its own.

    def krige_all(self):
        try:
            while True:
                with self.changed:
                    self.changed.wait_for(lambda: self.to_pack or self.closing)
                    if not self.to_pack:
                        return
                    frame = self.to_pack.popleft()
                    self.busy = True
                self.pack(frame)
                self.krige(self.ready())
                with self.changed:
                    self.busy = False
                    self.task = "kriging"
                    self.told()
                    self.changed.notify_all()
        except BaseException as failure:  # for the other thread to raise
            with self.changed:
                self.failure = failure
                self.changed.notify_all()

    def pack(self, frame):
        images = [self.image(frame.number, i) for i in range(frame.images)]
        dump, passes = (frames.name_of(name, frame.number) for name in (self.dumps(), self.templates()))
        report = self.ran("vlx-pack", "stack", *images, "-o", dump, "--overwrite", "--preset", "cycles", "--groups", "auto",
                          "--passes", passes, "--keep-empty")  # there is no border: all pixels are rendered
        for line in report.splitlines():
            if line.strip().startswith("For vlx-krige:"):
                self.radiance = shlex.split(line.split(":", 1)[1])
        if not self.options.target:
            self.remove(images)
        frame.packed = True

    def ready(self):
        """Frames that can be kriged: all that add to them are there."""
        return [f for f, window in self.windows.items() if not self.frames[f].kriged and all(self.frames[i].packed for i in window)]

    def krige_arguments(self, numbers):
        without = radiance_goes_not_with(self.options.krige)
        options = [] if without else [*self.radiance]
        if without and self.radiance:
            self.warn(f"WARNING: with {without} light groups and contributions are the samples' mean, as noisy as that, and may not "
                      "add up to the picture")
        if self.options.temporal:
            options += ["--temporal", str(self.options.temporal)]
        return [self.dumps(), "-o", self.pictures(), "--template", self.templates(), "--frames", ",".join(map(str, numbers)),
                "--overwrite", "--json", *options, *self.options.krige]

    def krige(self, ready):
        if not ready:
            return
        reports = self.ran("vlx-krige", *self.krige_arguments(ready))
        for number in ready:
            report, end = json.JSONDecoder().raw_decode(reports)
            reports = reports[end:].lstrip()
            self.judge(self.frames[number], report)
        self.forget()

    def judge(self, frame, report):
        """Whether the picture is good enough; if not, more images are asked for."""
        error = report.get("predictedRelMse")
        if self.options.target and "predictedRelMse" not in report:
            raise Failure("--target-error: expected vlx-krige to predict the relMSE, found none (--method gaussian has no error map)")
        error = math.inf if error is None and self.options.target else error  # of nothing but black
        missed = self.options.target and not error <= self.options.target
        if missed and frame.images < self.options.most_images:
            with self.changed:
                frame.asked = self.enough(frame.images, error)
                self.more.append(frame)
                frame.packed = False
                self.log.say(f"frame {frame.number}: relMSE {error:.3g} with {frame.images * self.options.samples} samples a pixel: "
                             f"goes on to {frame.asked * self.options.samples}")
            return
        if missed:
            self.missed.append(frame.number)
            self.log.warn(f"WARNING: frame {frame.number}: relMSE {error:.3g} with {frame.images * self.options.samples} samples a "
                          f"pixel, wanted {self.options.target:g} (--max-images)")
        if report.get("light") == 0:  # vlx-krige says so in words, which --json takes the place of
            self.log.say(f"frame {frame.number}: no sample has light")
        self.hand_over(frame, error)

    def enough(self, images, error):
        """How many images the wanted error is likely to take."""
        factor = (error / self.options.target) ** (1 / ERROR_FALLS) if math.isfinite(error) else MOST_AT_ONCE
        return min(max(math.ceil(images * min(factor, MOST_AT_ONCE)), images + 1), self.options.most_images)

    def hand_over(self, frame, error):
        number = frame.number
        output = frames.name_of(self.options.output, number)
        os.replace(frames.name_of(self.pictures(), number), output)
        self.remove([frames.name_of(self.templates(), number), *(self.image(number, i) for i in range(frame.images))])
        frame.kriged = True
        samples = frame.images * self.options.samples
        said = "" if error is None else f", predicted relMSE {error:.3g}"
        if self.log.form == "json":
            self.log.record("frame", frame=number, output=os.path.abspath(output), samples=samples, predictedRelMse=error)
        else:
            self.log.say(f"{output}: {samples} samples a pixel{said}")

    def forget(self):
        """Dumps that no frame needs any more go, or to where they are kept."""
        needed = {i for f, window in self.windows.items() if not self.frames[f].kriged for i in window}
        for frame in self.frames.values():
            dump = frames.name_of(self.dumps(), frame.number)
            if frame.number in needed or not os.path.exists(dump):
                continue
            if self.options.keep:
                kept = frames.name_of(kept_name(self.options), frame.number)
                part = os.path.join(self.options.keeping, os.path.basename(kept))
                try:
                    shutil.move(dump, part)
                    os.replace(part, kept)
                except OSError as error:
                    raise Failure(f"{kept}: cannot be written: {error.strerror}") from None
            self.remove([dump, frames.name_of(self.templates(), frame.number)])

    @staticmethod
    def remove(files):
        for file in files:
            if os.path.exists(file):
                os.remove(file)

    def warn(self, message):
        """Once, and only what is wrong where --quiet was given."""
        if message not in self.said:
            self.said.add(message)
            (self.log.warn if "WARNING" in message else self.log.say)(message)

    def ran(self, program, *arguments):
        """Standard output of a program that did its work; what it says is passed on, once."""
        code, out, messages, failure = self.programs.run(program, *arguments, "--log", "json")
        warnings = [line.strip() for line in out.splitlines() if "WARNING" in line]
        for message in [*messages, *warnings]:
            self.warn(message.replace(self.temporary + os.sep, ""))
        if code != 0:
            what = failure.replace(self.temporary + os.sep, "") or f"{program} ended with exit code {code}"
            raise Failure(f"{self.options.output}: {what}")
        return out


def named(krige):
    """vlx-krige's options with their values."""
    for word, value in zip(krige, [*krige[1:], ""]):
        name, _, own = word.partition("=")
        yield name, own or value


def radiance_goes_not_with(krige):
    """Which of vlx-krige's options it is that --radiance goes without; empty: none."""
    for name, value in named(krige):
        if name in ("--denoiser", "--denoised"):
            return name
        if name == "--method" and value != "krige":
            return f"--method {value}"
    return ""


def kept_name(options):
    """What a frame's dump is called in the folder of --keep-samples."""
    return os.path.join(options.keep, "samples_" + os.path.basename(options.output))
