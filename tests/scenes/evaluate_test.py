#!/usr/bin/env python3
"""Tests make_scenes.py and tools/evaluate. Usage: evaluate_test.py FOLDER-OF-THE-PROGRAMS [unittest's options]"""

import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
MAKE = os.path.join(HERE, "make_scenes.py")
EVALUATE = os.path.join(HERE, "../../tools/evaluate")
BIN = ""
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def run(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True).stdout


def names():
    return run(MAKE, "--list").split()


def read(path):
    with open(path, "rb") as file:
        return file.read()


class MakeScenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.work.cleanup)
        run(MAKE, cls.work.name)

    def path(self, name):
        return os.path.join(self.work.name, name + ".glb")

    def test_bytes_are_the_same_again(self):
        with tempfile.TemporaryDirectory() as again:
            run(MAKE, again)
            for name in names():
                self.assertEqual(read(self.path(name)), read(os.path.join(again, name + ".glb")), name)

    def test_files_are_consistent(self):
        for name in names():
            data = read(self.path(name))
            magic, version, length, json_length, kind = struct.unpack_from("<4sIIII", data)
            self.assertEqual((magic, version, length, kind), (b"glTF", 2, len(data), 0x4E4F534A), name)
            gltf = json.loads(data[20:20 + json_length])
            binary = data[28 + json_length:]
            self.assertEqual(gltf["buffers"][0]["byteLength"], len(binary), name)
            for mesh in gltf["meshes"]:
                primitive = mesh["primitives"][0]
                indices = gltf["accessors"][primitive["indices"]]
                view = gltf["bufferViews"][indices["bufferView"]]
                corners = struct.unpack_from(f"<{indices['count']}H", binary, view["byteOffset"])
                for accessor in (gltf["accessors"][a] for a in primitive["attributes"].values()):
                    size = gltf["bufferViews"][accessor["bufferView"]]["byteLength"]
                    self.assertEqual(size, 4 * COMPONENTS[accessor["type"]] * accessor["count"], name)
                    self.assertEqual(max(corners), accessor["count"] - 1, name)

    def test_normals_agree_with_winding(self):
        """A face turned inside out would be black or glass the wrong way round."""
        for name in names():
            data = read(self.path(name))
            json_length = struct.unpack_from("<I", data, 12)[0]
            gltf = json.loads(data[20:20 + json_length])
            binary = data[28 + json_length:]

            def rows(index, letter, n):
                accessor = gltf["accessors"][index]
                offset = gltf["bufferViews"][accessor["bufferView"]]["byteOffset"]
                flat = struct.unpack_from(f"<{n * accessor['count']}{letter}", binary, offset)
                return [flat[i:i + n] for i in range(0, len(flat), n)]
            for mesh in gltf["meshes"]:
                primitive = mesh["primitives"][0]
                if "NORMAL" not in primitive["attributes"]:
                    continue
                p, n = (rows(primitive["attributes"][a], "f", 3) for a in ("POSITION", "NORMAL"))
                corners = [i for (i,) in rows(primitive["indices"], "H", 1)]
                for a, b, c in zip(*[iter(corners)] * 3):
                    u, v = ([p[k][i] - p[a][i] for i in range(3)] for k in (b, c))
                    face = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
                    self.assertGreater(sum(f * (n[a][i] + n[b][i] + n[c][i]) for i, f in enumerate(face)), 0, name)

    def test_tracer_reads_them_without_a_warning(self):
        for name in names():
            dump = os.path.join(self.work.name, "dump.exr")
            report = json.loads(run(os.path.join(BIN, "vlx-trace"), self.path(name), "-o", dump, "--width", "8",
                                    "--spp", "2", "--json"))
            self.assertEqual(report["warnings"], [], name)

    def test_unknown_name_is_bad_usage(self):
        done = subprocess.run([MAKE, self.work.name, "no_such_scene"], stderr=subprocess.PIPE)
        self.assertEqual(done.returncode, 2)


class Evaluate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.work.cleanup)
        cls.command = [EVALUATE, cls.work.name, "--bin", BIN, "--scene", "soft_shadow", "--scene", "noise_free",
                       "--reference-spp", "512", "--spp", "4,64", "--size", "24", "--method", "mean=--method mean",
                       "--method", "blur=--method gaussian --sigma 4"]
        run(*cls.command)
        cls.rows = json.loads(read(os.path.join(cls.work.name, "report.json")))

    def row(self, scene, spp, method):
        found = [r for r in self.rows if (r["scene"], r["spp"], r["method"]) == (scene, spp, method)]
        self.assertEqual(len(found), 1)
        return found[0]

    def test_every_result_has_a_row(self):
        self.assertEqual(len(self.rows), 2 * 2 * 2)

    def test_error_falls_with_samples(self):
        for scene in ("soft_shadow", "noise_free"):
            few, many = (self.row(scene, spp, "mean")["relmse_above_floor"] for spp in (4, 64))
            self.assertLess(many, few / 8)

    def test_floor_is_below_the_error_of_fewer_samples(self):
        for scene in ("soft_shadow", "noise_free"):
            self.assertGreater(self.row(scene, 4, "mean")["floor"], 0)
            self.assertLess(self.row(scene, 4, "mean")["floor"], self.row(scene, 64, "mean")["relmse"])

    def test_exact_pixels_are_left_out_of_coverage(self):
        row = self.row("noise_free", 64, "mean")
        self.assertGreater(row["exact_pixels"], 0)
        self.assertLess(row["within"][0], row["reliability"]["withinOne"])

    def test_gaussian_has_no_coverage(self):
        self.assertEqual(self.row("noise_free", 4, "blur")["within"], [None, None])

    def test_pictures_and_table_are_there(self):
        for name in ("side_by_side", "crops"):
            self.assertTrue(os.path.exists(os.path.join(self.work.name, "pictures/noise_free_064", name + ".png")))
        self.assertIn("| soft_shadow | 64 |", read(os.path.join(self.work.name, "report.md")).decode())

    def test_traces_only_what_is_missing(self):
        dump, reference = (os.path.join(self.work.name, "soft_shadow", f) for f in ("dump_004.exr", "reference.exr"))
        before = [os.stat(f).st_mtime_ns for f in (dump, reference)]
        run(*self.command, "--trace-only")
        self.assertEqual(before, [os.stat(f).st_mtime_ns for f in (dump, reference)])
        run(*self.command, "--trace-only", "--reference-spp", "768")
        self.assertEqual(before[0], os.stat(dump).st_mtime_ns)
        self.assertNotEqual(before[1], os.stat(reference).st_mtime_ns)

    def test_failure_of_a_program_is_a_failure(self):
        done = subprocess.run([*self.command, "--method", "bad=--no-such-option"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("vlx-krige", done.stderr)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop(1))
    unittest.main()
