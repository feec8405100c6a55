#!/usr/bin/env python3
"""vlx-blender, run as a user runs it, with scenes made by scenes.py. Usage: vlx_blender_test.py BIN [TEST ...]"""

import glob
import hashlib
import json
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import exr  # noqa: E402

BIN = os.path.abspath(sys.argv.pop(1))
SCENES = os.path.join(BIN, "..", "tests", "blender", "scenes")  # made once, for all cases
QUICK = ["--images", "2", "--spp", "2"]
LAYER = "ViewLayer."


def contents(path):
    with open(path, "rb") as file:
        return file.read()


def blender(script, *arguments, scene=None, env=None):
    done = subprocess.run(["blender", "-b", "--factory-startup", *([scene] if scene else []), "--python-exit-code", "1", "--python", script,
                           "--", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=env)
    assert done.returncode == 0, done.stdout
    return done.stdout


def setUpModule():
    """A start of Blender takes two seconds, and every case has a process of its own."""
    global SCENES
    script, program = os.path.join(HERE, "scenes.py"), os.path.realpath(shutil.which("blender"))
    made_of = hashlib.sha256(contents(script) + f"{program} {os.stat(program).st_mtime_ns}".encode()).hexdigest()[:16]
    SCENES = os.path.join(os.path.realpath(SCENES), made_of)
    if os.path.isdir(SCENES):
        return
    os.makedirs(os.path.dirname(SCENES), exist_ok=True)
    with tempfile.TemporaryDirectory(dir=os.path.dirname(SCENES)) as folder:
        blender(script, folder)
        try:
            shutil.copytree(folder, folder + ".whole")
            os.rename(folder + ".whole", SCENES)
        except OSError:  # another case was faster
            shutil.rmtree(folder + ".whole")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="vlx-blender-test.")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def command(self, scene, output, *options):
        return [os.path.join(BIN, "vlx-blender"), os.path.join(SCENES, scene), "-o", self.path(output), *options]

    def run_it(self, scene, output, *options, code=0, **how):
        done = subprocess.run(self.command(scene, output, *options), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def left(self):
        return sorted(os.listdir(self.folder))


class Pictures(Case):
    def test_light_groups_add_up_and_the_file_stays(self):
        before = hashlib.sha256(contents(os.path.join(SCENES, "plain.blend"))).digest()
        said = self.run_it("plain.blend", "room.exr", *QUICK, "--keep-samples", self.path("new"))
        self.assertNotIn("no sample has light", said)
        self.assertEqual(before, hashlib.sha256(contents(os.path.join(SCENES, "plain.blend"))).digest())
        self.assertEqual(self.left(), ["new", "room.exr"])
        channels, attributes = exr.read(self.path("room.exr"))
        self.assertNotIn("File", attributes)  # stamps would tell paths and dates
        for c in "RGB":
            beauty = channels[LAYER + "Combined." + c]
            self.assertGreater(max(beauty), 0.1)
            parts = zip(channels[LAYER + "Combined_key." + c], channels[LAYER + "Combined_fill." + c])
            self.assertLess(max(abs(a + b - whole) for (a, b), whole in zip(parts, beauty)), 1e-5 * max(beauty))
        printed = blender(os.path.join(HERE, "image_node.py"), self.path("room.exr"))
        outputs = json.loads(printed.split("outputs ")[1].splitlines()[0])
        self.assertIn("stddev", outputs)
        self.assertIn("Combined_key", outputs)

        # Switches of the scene do not reach the picture.
        said = self.run_it("switches.blend", "switches.exr", *QUICK)
        self.assertIn("strips are left out", said)
        self.assertIn("stereoscopy is off", said)
        self.assertEqual(channels, exr.read(self.path("switches.exr"))[0])

        # Images see different places of a pixel.
        subprocess.run([os.path.join(BIN, "vlx-pack"), "halves", self.path("new/samples_room.exr"), "-o", self.path("p")], check=True)

        def albedo(half):
            data = contents(self.path(f"p_{half}_albedo.pfm")).split(b"\n", 3)[3]
            return struct.unpack(f"<{40 * 32 * 3}f", data)
        differ = sum(a != b for a, b in zip(albedo("even"), albedo("odd")))
        self.assertGreater(differ, 40 * 32 * 3 / 20)  # edges of the checker

    def test_contributions_add_up_and_depths_are_there(self):
        self.run_it("passes.blend", "a.exr", *QUICK)
        channels, _ = exr.read(self.path("a.exr"))
        for c in "RGB":
            beauty = channels[LAYER + "Combined." + c]
            parts = zip(channels[LAYER + "Diffuse." + c], channels[LAYER + "Glossy." + c])
            self.assertLess(max(abs(a + b - whole) for (a, b), whole in zip(parts, beauty)), 1e-5 * max(beauty))
        self.assertEqual(len(self.left()), 1)
        middle = 16 * 40 + 20
        self.assertAlmostEqual(channels[LAYER + "Depth.Z"][middle], channels[LAYER + "Denoising Depth.Z"][middle], delta=0.5)
        self.assertGreater(channels[LAYER + "Depth.Z"][middle], 5)

    def test_more_images_until_the_error_is_met(self):
        # vlx-krige with a predicted error that is known: 0.04 of two images, falling as theory has it. It finds no light.
        os.mkdir(self.path("bin"))
        for name in ("vlx-blender", "vlx-pack"):
            os.symlink(os.path.realpath(os.path.join(BIN, name)), self.path("bin/" + name))
        program = self.path("bin/vlx-krige")
        with open(program, "w") as file:
            file.write(f"""#!{sys.executable}
import json, subprocess, sys
done = subprocess.run([{os.path.join(BIN, "vlx-krige")!r}, *sys.argv[1:]], stdout=subprocess.PIPE, text=True)
if "--json" in sys.argv and done.stdout:
    report = json.loads(done.stdout)
    report["predictedRelMse"] = 0.04 * (2 / (report["samples"] / 1280)) ** 0.6
    assert report["light"] > 0
    report["light"] = 0.0
    done.stdout = json.dumps(report)
print(done.stdout, end="")
sys.exit(done.returncode)
""")
        os.chmod(program, 0o755)

        def run_it(code, *options):
            command = [self.path("bin/vlx-blender"), *self.command("plain.blend", *options)[1:], "--spp", "1"]
            done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, code, done.stderr)
            return done.stderr
        said = run_it(0, "a.exr", "--images", "2", "--target-error", "relmse=0.02")
        self.assertIn("relMSE 0.04 with 2 samples a pixel: goes on to 6", said)
        self.assertIn("relMSE 0.0207 with 6 samples a pixel: goes on to 7", said)
        self.assertIn("7 samples a pixel, predicted relMSE 0.0189", said)
        self.assertEqual(said.count("frame 3: no sample has light\n"), 1)
        run_it(0, "b.exr", "--images", "7")
        self.assertEqual(exr.read(self.path("a.exr"))[0], exr.read(self.path("b.exr"))[0])
        said = run_it(3, "c.exr", "--images", "2", "--target-error", "relmse=0.02", "--max-images", "3", "-q")
        self.assertIn("WARNING: frame 3: relMSE 0.0314 with 3 samples a pixel, wanted 0.02 (--max-images)", said)
        self.assertEqual(self.left(), ["a.exr", "b.exr", "bin", "c.exr"])

    def test_a_file_of_another_engine_with_cycles(self):
        said = self.run_it("eevee.blend", "a.exr", code=1)
        self.assertIn("expected the engine CYCLES, found BLENDER_EEVEE; --engine CYCLES", said)
        self.run_it("eevee.blend", "a.exr", "--engine", "CYCLES", *QUICK)
        self.assertEqual(self.left(), ["a.exr"])

    def test_files_that_lack_something(self):
        data = contents(os.path.join(SCENES, "textures.blend"))
        with open(self.path("newer.blend"), "wb") as file:
            file.write(data[:9] + b"999" + data[12:])
        said = self.run_it(self.path("newer.blend"), "a.exr", *QUICK, "-q", "--", "--method", "mean")
        self.assertIn("was saved by Blender 9.99, newer than 3.4", said)
        self.assertIn("names 1 file that is not there: " + self.path("textures/bricks.png"), said)
        self.assertIn("WARNING: with --method mean light groups and contributions are the samples' mean", said)


class Sequences(Case):
    def test_frames_of_the_file_are_finished_once(self):
        said = self.run_it("plain.blend", "f_##.exr", *QUICK, "--log", "json")
        self.assertEqual(self.left(), ["f_02.exr", "f_04.exr", "f_06.exr"])
        records = [json.loads(line) for line in said.splitlines()]
        self.assertEqual([r["frame"] for r in records if r["event"] == "frame"], [2, 4, 6])
        self.assertEqual([r["samples"] for r in records if r["event"] == "frame"], [4, 4, 4])
        self.assertEqual([r["fraction"] for r in records if r["event"] == "progress"][-1], 1)
        self.assertEqual(records[-1]["event"], "end")
        self.assertEqual(records[-1]["exitCode"], 0)
        times = {name: os.stat(self.path(name)).st_mtime_ns for name in self.left()}
        os.remove(self.path("f_04.exr"))
        said = self.run_it("plain.blend", "f_##.exr", *QUICK)
        self.assertEqual(said.count("is finished (same file and options), skipped"), 2)
        self.assertEqual(os.stat(self.path("f_06.exr")).st_mtime_ns, times["f_06.exr"])
        self.assertTrue(os.path.exists(self.path("f_04.exr")))
        said = self.run_it("plain.blend", "f_##.exr", "--frames", "6", *QUICK, "--", "--quality", "draft")
        self.assertGreater(os.stat(self.path("f_06.exr")).st_mtime_ns, times["f_06.exr"])

    def test_neighbours_add_as_vlx_krige_adds_them(self):
        frames = ["--frames", "3-6", "--temporal", "1"]
        self.run_it("plain.blend", "t_##.exr", *frames, *QUICK, "--keep-samples", self.folder)
        groups = ["--radiance", LAYER + "Combined_key", "--radiance", LAYER + "Combined_fill"]
        subprocess.run([os.path.join(BIN, "vlx-krige"), self.path("samples_t_##.exr"), "-o", self.path("k_##.exr"), *frames, *groups, "-q"],
                       check=True)
        for frame in range(3, 7):
            pictures = exr.read(self.path(f"t_{frame:02}.exr"))[0]
            kriged = exr.read(self.path(f"k_{frame:02}.exr"))[0]
            for c in "RGB":
                self.assertEqual(pictures[LAYER + "Combined." + c], kriged[c], f"frame {frame}, {c}")
            if frame == 5:  # the ball moves fastest
                self.assertGreater(max(map(abs, pictures[LAYER + "Vector.X"])), 0.5)
        # A frame that is there is rendered once more where others need it, and not written.
        os.remove(self.path("t_06.exr"))
        times = os.stat(self.path("t_05.exr")).st_mtime_ns
        for samples in glob.glob(self.path("samples*")):
            os.remove(samples)
        before = exr.read(self.path("k_06.exr"))[0]
        self.run_it("plain.blend", "t_##.exr", *frames, *QUICK)
        self.assertEqual(exr.read(self.path("t_06.exr"))[0][LAYER + "Combined.R"], before["R"])
        self.assertEqual(os.stat(self.path("t_05.exr")).st_mtime_ns, times)

    def test_vectors_that_motion_blur_takes(self):
        said = self.run_it("blurred.blend", "t_##.exr", "--frames", "1-2", "--temporal", "1", *QUICK)
        self.assertIn("with motion blur Blender writes no motion vectors", said)

    def test_runs_in_one_folder(self):
        os.mkdir(self.path(".vlx-blender-killed"))  # what a run that was killed has left: no lock
        with open(self.path(".vlx-blender-killed/run"), "w") as file:
            json.dump({"process": 1, "host": "here", "pictures": ["f_01.exr", "f_02.exr"]}, file)
        said = []
        for frames in (["1-2", "1-2", "3"], ["2"]):
            runs = [subprocess.Popen(self.command("plain.blend", "f_##.exr", "--frames", each, *QUICK), stderr=subprocess.PIPE, text=True)
                    for each in frames]
            said += [(one.communicate()[1], one.returncode) for one in runs]
        self.assertEqual(sorted(code for _, code in said), [0, 0, 0, 1], said)
        refused = next(text for text, code in said if code)
        self.assertRegex(refused, r"f_01.exr and 1 more: expected no other vlx-blender at work on it, found process \d+ on .*: wait")
        self.assertEqual(said[2][1], 0)
        self.assertIn("f_02.exr: is finished", said[3][0])
        self.assertEqual(self.left(), [".vlx-blender-killed", "f_01.exr", "f_02.exr", "f_03.exr"])


class Ends(Case):
    def end_by(self, number, **how):
        with open(self.path("blender"), "w") as file:
            file.write(f"#!/bin/sh\necho $$ >{self.path('pid')}\nexec blender \"$@\"\n")
        os.chmod(self.path("blender"), 0o755)
        os.mkdir(self.path("out"))
        command = self.command("plain.blend", "out/f_##.exr", "--frames", "1-900", "--log", "json", "--blender", self.path("blender"))
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **how) as run:
            for line in run.stderr:
                if json.loads(line)["event"] == "frame":
                    break
            if how:
                run.send_signal(signal.SIGINT)  # ignored
                time.sleep(0.3)
                self.assertIsNone(run.poll())
            run.send_signal(number)
            run.stderr.read()
        self.assertEqual(run.returncode, -number)
        pictures = os.listdir(self.path("out"))
        self.assertTrue(pictures)
        for name in pictures:  # those that were done, complete, and nothing else
            self.assertRegex(name, r"^f_\d\d\.exr$")
            self.assertIn("Note", exr.read(self.path("out/" + name))[1])
        with self.assertRaises(ProcessLookupError):
            os.kill(int(contents(self.path("pid"))), 0)

    def test_terminated_in_the_background(self):
        self.end_by(signal.SIGTERM, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))  # as `vlx-blender &` in sh

    def test_interrupted(self):
        self.end_by(signal.SIGINT)

    def test_a_full_disk(self):
        def limit():  # of the size of a file: writing fails, as on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        said = self.run_it("plain.blend", "a.exr", *QUICK, code=1, preexec_fn=limit)
        self.assertRegex(said, "(?s)plain.blend: OpenEXR-.*image_0003_0000.exr.*File too large")
        self.assertEqual(self.left(), [])

    def test_blender_that_ends_early(self):
        with open(self.path("blender"), "w") as file:
            file.write("#!/bin/sh\necho 'Error: no such device' >&2\nkill -9 $$\n")
        os.chmod(self.path("blender"), 0o755)
        said = self.run_it("plain.blend", "a.exr", "--blender", self.path("blender"), code=1)
        self.assertIn("Blender was ended by signal 9\n  Blender: Error: no such device", said)
        self.assertEqual(self.left(), ["blender"])


class AddOn(Case):
    def test_pictures_and_sequences_are_opened(self):
        home = {**os.environ, "BLENDER_USER_CONFIG": self.path("config"), "BLENDER_USER_SCRIPTS": self.path("scripts")}
        os.mkdir(self.path("scripts"))
        archive = os.path.join(BIN, "..", "tools", "blender", "variolux-blender.zip")
        scene = shutil.copy(os.path.join(SCENES, "plain.blend"), self.path("scene.blend"))
        printed = blender(os.path.join(HERE, "addon_steps.py"), archive, os.path.join(BIN, "vlx-blender"), self.folder, scene=scene, env=home)
        found = json.loads(printed.split("\nfound ")[1].splitlines()[0])
        self.assertEqual(found["still"], ["FINISHED"])
        self.assertIn("stddev", found["still node"]["outputs"])
        self.assertIn("Combined_fill", found["still node"]["outputs"])
        self.assertEqual(found["still node"]["source"], "FILE")
        self.assertEqual(found["shot"], ["FINISHED"])
        shot = found["shot node"]
        self.assertEqual((shot["file"], shot["source"], shot["type"], shot["frames"]), ("shot_02.exr", "SEQUENCE", "MULTILAYER", [2, 1, 2]))
        for frame in (2, 3):
            comped = exr.read(self.path(f"comped_{frame:04}.exr"))[0]
            self.assertEqual(comped["R"], exr.read(self.path(f"shot_{frame:02}.exr"))[0][LAYER + "Combined.R"])
        self.assertIn("expected a camera in the scene 'Scene', found none", found["no camera"])
        self.assertIn("no-such-program: No such file or directory: set the path of vlx-blender", found["no program"])
        self.assertTrue(found["off"])
        self.assertEqual(contents(scene), contents(os.path.join(SCENES, "plain.blend")))  # never saved


class BadInput(Case):
    def told(self, expected, scene, output="a.exr", *options, code=1):
        said = self.run_it(scene, output, *options, code=code)
        self.assertIn(expected, said)
        self.assertEqual([name for name in self.left() if name.endswith(".exr") or name.startswith(".")], [])
        return said

    def test_scenes(self):
        self.told("none.blend: cannot be read: No such file or directory", "none.blend")
        self.told("expected a Blender file (.blend), found something else", os.path.abspath(__file__))
        self.told("expected a camera in the scene 'Scene', found none but strips of the sequencer", "edit.blend")
        data = contents(os.path.join(SCENES, "plain.blend"))
        with open(self.path("cut.blend"), "wb") as file:
            file.write(data[:len(data) // 3])
        self.told("Failed to read blend file", self.path("cut.blend"))

    def test_usage(self):
        no_blender = ["--blender", "/bin/false"]  # found out before that
        self.told("expected #### for the number of each of 2 frames", "plain.blend", "a.exr", *no_blender, "--frames", "1-2", code=2)
        self.told("expected a name that ends with .exr", "plain.blend", "a.png", code=2)
        for expected, *krige in (("expected one of draft|standard|high, found 'best'", "--quality", "best"),
                                 ("--sigma goes with --method gaussian", "--sigma", "2"),
                                 ("--samples: goes with a flat image", "--samples=4"), ("found one that only prints something", "--help"),
                                 ("--diagnostics: goes without the layers", "--diagnostics")):
            self.told(expected, "plain.blend", "a.exr", *no_blender, "--", *krige, code=2)
        self.told("how good a frame is would depend on how many images its neighbours get. Take one of them; with --temporal choose "
                  "--images", "plain.blend", "a_##.exr", "--temporal", "1", "--target-error", "relmse=1", code=2)
        for option in ("--frames", "-q"):
            self.told(f"{option}: give it before --\n", "plain.blend", "a.exr", *no_blender, "--", option, "1", code=2)
        for option in ("--json", "--drop-layers", "--radiance", "--template"):
            self.told(f"{option}: not with vlx-blender\n", "plain.blend", "a.exr", *no_blender, "--", option, code=2)
        for option in ("--frames", "--view-layer", "--keep-samples", "--blender", "--output"):
            self.told(f"{option}: expected a value, found an empty one", "plain.blend", "a.exr", *no_blender, option, "", code=2)
            self.told(f"{option}: expected a value, found an empty one", "plain.blend", "a.exr", *no_blender, option + "=", code=2)
        for option in ("--images", "--spp", "--max-images", "--temporal", "--threads", "--target-error", "--engine", "--log"):
            self.told(f"{option}: ", "plain.blend", "a.exr", *no_blender, option, "", code=2)
        self.told("--max-images: only with --target-error", "plain.blend", "a.exr", *no_blender, "--max-images", "64", code=2)
        self.told("without a word of Blender's", "plain.blend", "a.exr", *no_blender, "--images", "100")  # above --max-images' default
        self.told("--max-images: expected at least --images, 8, found 7", "plain.blend", "a.exr", *no_blender, "--images", "8",
                  "--max-images", "7", "--target-error", "relmse=1", code=2)
        self.told("expected frames such as 1-100x2,150, found '4-1'", "plain.blend", "a_##.exr", "--frames", "4-1", code=2)
        self.told("expected one of ViewLayer, found 'Foreground'", "plain.blend", "a.exr", "--view-layer", "Foreground", code=2)
        self.told("expected relmse=X with X above 0, found '0.01'", "plain.blend", "a.exr", "--target-error", "0.01", code=2)
        self.told("--images: expected a whole number of 2 to 4096, found '1'", "plain.blend", "a.exr", "--images", "1", code=2)
        self.told("expected frames that follow each other", "plain.blend", "a_##.exr", "--frames", "2-6x2", "--temporal", "1", code=2)
        self.told("unrecognized arguments: --nonsense", "plain.blend", "a.exr", "--nonsense", code=2)

    def test_places(self):
        self.told("expected the folder", "plain.blend", "none/a.exr")
        self.told("no-such-blender: expected Blender 3.4 or later", "plain.blend", "a.exr", "--blender", "no-such-blender")
        said = self.told("/bin/false: expected Blender 3.4 or later, found a program that ended (exit code 1) without a word of Blender's "
                         "(--blender PATH)", "plain.blend", "a.exr", "--blender", "/bin/false")
        self.assertNotIn("plain.blend", said)
        self.told("--denoiser: expected the program no-denoiser in PATH, found none", "plain.blend", "a.exr", "--blender", "/bin/false",
                  "--", "--denoiser", "no-denoiser {color} {output}")
        self.told("/proc: expected a folder that can be written into", "plain.blend", "/proc/a.exr")
        os.mkdir(self.path("folder.exr"))
        said = self.run_it("plain.blend", "folder.exr", code=1)
        self.assertIn("folder.exr: expected a place for a picture, found a folder", said)


if __name__ == "__main__":
    if not shutil.which("blender"):
        print("Blender is not installed (apt-get install --no-install-recommends blender): skipped")
        sys.exit(77)
    unittest.main(verbosity=2)
