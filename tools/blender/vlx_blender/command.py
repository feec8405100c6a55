"""The command line of vlx-blender, and a run from its start to its end."""

import argparse
import os
import pathlib
import shlex
import shutil
import signal
import sys
import tempfile

from . import finished, frames, manual
from .blender import Blender, check_scene_file
from .claim import FOLDER, claim
from .log import BAD_USAGE, DONE, FAILED, PASSED, Failure, Log, Usage, counted
from .processes import Children, Programs
from .shot import Options, Shot, kept_name, named

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
MOST_IMAGES = 64  # --max-images, where it is not given
# Of vlx-krige's options those that are set here: those that vlx-blender has as well, and the others.
OWN = {"-o", "--output", "--frames", "--temporal", "--log", "--overwrite", "-q", "--quiet", "--threads"}
SET = {"--template", "--drop-layers", "--radiance", "--json"}
WITHOUT = {"--band", "--scale", "--max-memory", "--assess", "--diagnostics"}  # those that go without the layers of Blender's file
FLAT = {"--preset", "--variance-is", "--variance-of", "--variance", "--albedo", "--normal", "--depth", "--samples"}  # of flat images

DESCRIPTION = """Renders a Blender file with Cycles, takes out the noise by kriging, and says how accurate each picture is.
One Blender in the background renders every frame as a few images of a few samples; each frame is packed and kriged while the next one
renders. The pictures are OpenEXR files with the layers of Blender's own: light groups and contributions (Diffuse, Glossy, ...) denoised
together with the beauty, which they add up to; other passes averaged; stddev added, the standard deviation of the error of R, G, B. The
file is never saved."""

FOOTER = """Examples:
  vlx-blender room.blend -o room.exr
  vlx-blender shot.blend -o out_####.exr --frames 1-100 --temporal 2
  vlx-blender shot.blend -o out_####.exr --images 8 --spp 8 -- --quality high

Changed while rendering: samples, sample offset, seed (another for each frame),
sampling pattern, time limit; off are denoising, adaptive sampling, border,
stamps, stereo, compositor and sequencer; on are denoising data. All else is the
scene's own.

Exit codes: 0 done; 1 failure at run time (a file, the disk, Blender); 2 bad
usage; 3 a frame's error stayed above --target-error. Ended by a signal (Ctrl-C,
SIGTERM, SIGHUP), it leaves no unfinished files, and Blender ends with it. To end
a job in the background use kill (SIGTERM): scripts start what has an & behind it
with Ctrl-C's signal, SIGINT, switched off."""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise Usage(message)


def given(text):
    """Most likely a variable of the shell that is not set: it must not pass for an option that was not given."""
    if not text:
        raise argparse.ArgumentTypeError("expected a value, found an empty one")
    return text


def whole(least, most):
    def check(text):
        if not text.isdigit() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"expected a whole number of {least} to {most}, found '{text}'")
        return int(text)
    return check


def relative_error(text):
    try:
        name, value = text.split("=")
        value = float(value)
    except ValueError:
        name, value = text, 0.0
    if name != "relmse" or not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected relmse=X with X above 0, found '{text}'")
    return value


def parser():
    p = Parser("vlx-blender", usage="vlx-blender SCENE.blend -o OUTPUT [options] [-- options of vlx-krige]", description=DESCRIPTION,
               epilog=FOOTER, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, add_help=False)
    add = p.add_argument
    add("scene", type=given, metavar="SCENE.blend", help="The Blender file, of Blender 3.4 or later")
    add("-o", "--output", type=given, metavar="OUTPUT", required=True, help="OpenEXR picture to write; #### stands for the frame's number")
    add("--frames", type=given, metavar="LIST", help="Frames, for example 1-100x2,150; negative ones are not possible (default: the file's frames if OUTPUT has ####, else its current one)")
    add("--images", type=whole(2, 4096), default=4, metavar="N", help="Images that a frame is rendered as. Their differences tell how noisy a pixel is")
    add("--spp", type=whole(1, 65536), default=4, metavar="N", help="Samples a pixel of each image")
    add("--target-error", type=relative_error, metavar="relmse=X", help="Render more images of a frame until its predicted relMSE is X or less")
    add("--max-images", type=whole(2, 4096), metavar="N", help=f"With --target-error: images of a frame at most. One that has not got there is written all the same, and told (default: {MOST_IMAGES})")
    add("--temporal", type=whole(0, 8), default=0, metavar="N", help="Data of N frames before and N after add to each frame, moved by Blender's motion vectors. Best without motion blur, with which Blender writes none")
    add("--engine", choices=["CYCLES"], help="Render with Cycles a file that is set to another engine, which is else refused")
    add("--view-layer", type=given, metavar="NAME", help="The view layer to render (default: the first one that is rendered)")
    add("--keep-samples", type=given, metavar="FOLDER", help="Keep the samples of each frame in this folder, which is made if need be, as samples_OUTPUT, for vlx-krige")
    add("--blender", type=given, metavar="PATH", default="blender", help="Blender's program")
    add("--threads", type=whole(0, 1024), default=0, metavar="N", help="Of Blender and of vlx-krige, which run at the same time. 0: all processors")
    add("--overwrite", action="store_true", help="Render frames even if their pictures are there and were made by these programs from the same file with the same options, which are else skipped. Textures and linked files are not looked at")
    add("--log", choices=["text", "json", "openjd"], default="text", help="Progress for people, as lines of JSON on standard error, or as Open Job Description's lines on standard output")
    add("-q", "--quiet", action="store_true", help="Print nothing but errors and warnings")
    add("-h", "--help", action="store_true", help="Print this help and exit")
    add("--version", action="store_true", help="Print the version and exit")
    return p


def check(o, krige):
    """What can be told before Blender starts. Of options that do not fit: Usage; of files: Failure."""
    if not o.output.endswith(".exr"):
        raise Usage(f"--output: expected a name that ends with .exr, found '{o.output}'")
    if "#" in os.path.dirname(o.output):
        raise Usage(f"--output: expected #### in the file's name alone, found '{o.output}'")
    for word in krige:
        name = word.split("=")[0]
        if name in OWN:
            raise Usage(f"{name}: give it before --")
        if name in SET:
            raise Usage(f"{name}: not with vlx-blender")
        if name in WITHOUT:
            raise Usage(f"{name}: goes without the layers of Blender's file, which pictures keep: use --keep-samples, then vlx-krige")
        if name in FLAT:
            raise Usage(f"{name}: goes with a flat image that has a variance; here samples are kriged")
    if o.temporal and not frames.has_place(o.output):
        raise Usage("--temporal goes with #### in --output: frames add to each other")
    if o.temporal and o.target_error:
        raise Usage("--target-error goes without --temporal: how good a frame is would depend on how many images its neighbours get. "
                    "Take one of them; with --temporal choose --images for the whole shot")
    if o.frames:
        check_frames(o, frames.parse(o.frames))
    if not frames.has_place(o.output):
        check_place(o.output)
    if o.max_images and not o.target_error:
        raise Usage("--max-images: only with --target-error; here nothing reads it")
    o.max_images = o.max_images or MOST_IMAGES
    if o.target_error and o.max_images < o.images:
        raise Usage(f"--max-images: expected at least --images, {o.images}, found {o.max_images}")
    check_scene_file(o.scene)
    folder = os.path.dirname(o.output) or "."
    if not os.path.isdir(folder):
        raise Failure(f"--output: expected the folder '{folder}', found none")


def check_place(picture):
    if os.path.isdir(picture):
        raise Failure(f"{picture}: expected a place for a picture, found a folder")


def check_frames(o, chosen):
    if len(chosen) > 1 and not frames.has_place(o.output):
        raise Usage(f"--output: expected #### for the number of each of {len(chosen)} frames, found '{o.output}'")
    if o.temporal and len(chosen) > 1 and not any(f + 1 in chosen for f in chosen):
        raise Usage("--temporal: expected frames that follow each other, found none with a neighbour")


def check_about(about, o, log):
    """Of a scene that cannot be rendered: Failure. What is left out or missing is told."""
    scene = o.scene
    if about["layer"] is None and o.view_layer:
        raise Usage(f"--view-layer: expected one of {', '.join(about['layers'])}, found '{o.view_layer}'")
    if about["layer"] is None:
        raise Failure(f"{scene}: expected a view layer that is used for rendering, found none (--view-layer)")
    if not about["cycles"]:
        raise Failure(f"{scene}: expected a Blender with Cycles, found {about['blender']} without it (its add-on is off)")
    if not about["camera"]:
        edit = " but strips of the sequencer, which hold nothing to be traced" if about["strips"] else ""
        raise Failure(f"{scene}: expected a camera in the scene '{about['scene']}', found none{edit}")
    if about["engine"] != "CYCLES" and not o.engine:
        raise Failure(f"{scene}: expected the engine CYCLES, found {about['engine']}; --engine CYCLES renders it with Cycles, "
                      "where it may look otherwise")
    if about["fileVersion"][:2] > about["version"][:2]:
        log.warn(f"WARNING: {scene} was saved by Blender {'.'.join(map(str, about['fileVersion'][:2]))}, newer than {about['blender']}: "
                 "what that does not know is lost (--blender PATH)")
    if about["missing"]:
        missing = about["missing"]
        log.warn(f"WARNING: {scene} names {counted(len(missing), 'file')} that {'is' if len(missing) == 1 else 'are'} not there: " +
                 ", ".join(missing[:10]) + (", ..." if len(missing) > 10 else ""))
    if about["scenes"] > 1 or (len(about["layers"]) > 1 and not o.view_layer):
        log.say(f"rendered is the scene '{about['scene']}', view layer '{about['layer']}' (--view-layer; the scene is the one that was "
                "active when the file was saved)")
    if about["strips"]:
        log.say("the sequencer's strips are left out")
    if about["stereo"]:
        log.say("stereoscopy is off: one view is rendered")
    if o.temporal and about["motionBlur"]:
        log.warn("WARNING: with motion blur Blender writes no motion vectors: other frames are used as they lie, which helps little "
                 "where things move")


def check_krige_options(o, krige, programs, temporary):
    """Bad usage is found now, not after the first frame: there is no dump, so nothing is kriged."""
    none = os.path.join(temporary, "none_####.exr")
    temporal = ["--temporal", str(o.temporal)] if o.temporal else []
    code, _, _, failure = programs.run("vlx-krige", none, "-o", os.path.join(temporary, "kriged_####.exr"), "--template", none,
                                       "--frames", "0", *temporal, *krige, "--log", "json")
    if code == BAD_USAGE:
        raise Usage(f"options of vlx-krige: {failure.removeprefix('vlx-krige: ').split(chr(10))[0]}")
    if code == DONE:
        raise Usage("options of vlx-krige: expected those of kriging, found one that only prints something (vlx-krige --help)")
    for command in (value for name, value in named(krige) if name == "--denoiser"):
        program = "oidnDenoise" if command == "oidn" else shlex.split(command)[0]
        if not shutil.which(program):
            raise Failure(f"--denoiser: expected the program {program} in PATH, found none")


def chosen_frames(o, about):
    if o.frames:
        return frames.parse(o.frames)
    if frames.has_place(o.output):
        first, last, step = about["frames"]
        chosen = list(range(first, last + 1, step))
    else:
        chosen = [about["frame"]]
    if not chosen or chosen[0] < 0:
        raise Failure(f"{o.scene}: expected frames from 0, found {about['frames'][0]} to {about['frames'][1]} (--frames)")
    check_frames(o, chosen)
    return chosen


def notes_of(o, krige, about, shot, programs):
    """What the header of each frame's picture is to say: what it was made of."""
    made = finished.digest("vlx-blender", programs.version(), *(pathlib.Path(path) for path in programs.paths.values()), about["blender"],
                           pathlib.Path(o.scene), o.images, o.spp, o.target_error, o.max_images, o.temporal, about["layer"], krige,
                           shot if o.temporal else "")
    return {frame: f"vlx-blender {finished.digest(made, frame)}" for frame in shot}


def run(o, krige, folders, log, children):
    check(o, krige)
    programs = Programs(folders, children)
    hidden = []
    try:
        temporary, keeping = (hidden_folder(folder, hidden) if folder else ""
                              for folder in (os.path.dirname(o.output) or ".", o.keep_samples))
        check_krige_options(o, krige, programs, temporary)
        return render(o, krige, programs, log, children, temporary, keeping)
    finally:
        for number in SIGNALS:  # a second Ctrl-C must not keep the rest
            signal.signal(number, signal.SIG_IGN)
        children.end()
        for folder in hidden:
            shutil.rmtree(folder, ignore_errors=True)


def hidden_folder(place, hidden):
    """For what is not complete; entered into `hidden`."""
    try:
        os.makedirs(place, exist_ok=True)
        hidden.append(os.path.abspath(tempfile.mkdtemp(prefix=FOLDER, dir=place)))
    except OSError as error:
        raise Failure(f"{place}: expected a folder that can be written into: {error.strerror}") from None
    return hidden[-1]


def render(o, krige, programs, log, children, temporary, keeping):
    shot = None
    wish = {"samples": o.spp, "viewLayer": o.view_layer, "vectors": o.temporal > 0}
    blender = Blender(o.blender, o.scene, wish, children, temporary, o.threads, lambda part: shot and shot.sampled(part))
    about = blender.about
    check_about(about, o, log)
    chosen = chosen_frames(o, about)
    options = Options(o.output, o.images, o.spp, o.temporal, o.target_error or 0.0, o.max_images, o.keep_samples or "", keeping,
                      [*krige, *(["--threads", str(o.threads)] if o.threads else [])], about["firstSample"])
    notes = notes_of(o, krige, about, chosen, programs)

    def is_finished(frame):
        kept = not options.keep or os.path.exists(frames.name_of(kept_name(options), frame))
        return kept and not o.overwrite and finished.note(frames.name_of(o.output, frame)) == notes[frame]

    wanted = [frame for frame in chosen if not is_finished(frame)]
    pictures = [frames.name_of(o.output, frame) for frame in wanted]
    for picture in pictures:
        check_place(picture)
    if wanted:
        taken = claim(temporary, pictures)  # until it is closed, with the run
        wanted = [frame for frame in wanted if not is_finished(frame)]  # meanwhile, by another run
    for frame in chosen:
        if frame not in wanted:
            output = frames.name_of(o.output, frame)
            log.say(f"{output}: is finished (same file and options), skipped; --overwrite makes it again")
            log.record("frame", frame=frame, output=os.path.abspath(output), skipped=True)
    if not wanted:
        return DONE
    shot = Shot(options, chosen, wanted, notes, blender, programs, log, temporary)
    shot.run()
    blender.close()
    taken.close()
    return PASSED if shot.missed else DONE


class Ended(BaseException):
    """By a signal."""


def catch_signals():
    def end(number, _):
        raise Ended(number)
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:  # nohup, background jobs
            signal.signal(number, end)


def main(arguments, *folders):
    """The exit code. Programs are looked for in `folders` first."""
    folders = [*folders, os.path.join(folders[-1], "..", "..", "build", "release", "bin")]
    own, krige = arguments[1:], []
    if "--" in own:
        own, krige = own[:own.index("--")], own[own.index("--") + 1:]
    log, children, options = Log(), Children(), parser()
    catch_signals()
    code, message = DONE, ""
    try:
        if printed := manual.printed(options, own, lambda: Programs(folders, children).version()):
            print(printed)
            return DONE
        o = options.parse_args(own)
        log.__init__(o.log, o.quiet)
        code = run(o, krige, folders, log, children)
    except Usage as error:
        print(f"vlx-blender: {error}\nRun vlx-blender --help for the options.", file=sys.stderr)
        return BAD_USAGE
    except Failure as error:
        code, message = FAILED, str(error)
    except OSError as error:
        code, message = FAILED, f"{error.filename}: {error.strerror}" if error.filename else str(error)
    except Ended as ended:
        log.erase()
        signal.signal(ended.args[0], signal.SIG_DFL)
        os.kill(os.getpid(), ended.args[0])
    log.end(code, message)
    return code
