#!/usr/bin/env python3
"""Writes the hard cases of this folder: kriging problems as a renderer makes them, with exact answers.

    python3 generate.py        (needs python3-mpmath; a few minutes; files are the same on every run)

The format is that of testdata/hard/README.md.
"""
import json
import os
import random
import struct
import sys

from exact_kriging import solve

FOLDER = os.path.dirname(os.path.abspath(__file__))
ALL = ["finite", "weights_sum", "variance_nonneg", "within_tolerance", "permutation", "translation", "rotation",
       "affine_values"]
DRIFT = ["finite", "weights_sum", "drift_reproduced", "variance_nonneg", "within_tolerance"]
BASIC = ["finite", "weights_sum", "variance_nonneg", "within_tolerance"]


def f32(v):
    """A number as a dump stores it."""
    return struct.unpack("f", struct.pack("f", v))[0]


def structure(kind, sill, reach, alpha=None):
    s = {"type": kind, "sill": sill, "range": reach}
    if alpha is not None:
        s["alpha"] = alpha
    return s


def sobol(count):
    """First points of the two-dimensional Sobol sequence."""
    v1 = [1 << (31 - i) for i in range(32)]
    v2 = [1 << 31]
    for _ in range(31):
        v2.append(v2[-1] ^ (v2[-1] >> 1))
    points = []
    for k in range(count):
        a = b = 0
        for bit in range(32):
            if k >> bit & 1:
                a ^= v1[bit]
                b ^= v2[bit]
        points.append((a / 2 ** 32, b / 2 ** 32))
    return points


def grid(width, height, x0=0.0, y0=0.0):
    return [x0 + i % width + 0.5 for i in range(width * height)], [y0 + i // width + 0.5 for i in range(width * height)]


def shading(x, y, rng, noise):
    """Radiance like a wall's: a gradient, a soft shadow, noise."""
    shadow = 0.4 if x + 0.5 * y > 6 else 1.0
    return f32(max(0.0, shadow * (0.6 + 0.03 * x - 0.02 * y) + noise * rng.gauss(0, 1)))


def write(name, title, why, model_structures, data, targets, properties, nugget=0.0, error_nugget=0.0,
          kriging="ordinary", drift="1", mean=None, keep=None, digits=120, twin_error=None, tolerance=None,
          status="ok", masked=None, note=None):
    if len(sys.argv) > 1 and name not in sys.argv[1:]:
        return
    model = {"nugget": nugget, "error_nugget": error_nugget, "structures": model_structures}
    case = {"id": name, "title": title, "why": why, "model": model, "kriging": kriging, "drift": drift,
            "mean": mean, "data": data, "targets": targets}
    total = nugget + sum(s["sill"] for s in model_structures)
    if status == "error":
        case["expect"] = {"status": status, "tolerance": {}, "properties": ["error"]}
        case["cond_double_estimate"] = None
    else:
        exact = dict(case)
        if masked is not None:  # the answer without the unusable data
            exact["data"] = {key: [v for i, v in enumerate(values) if i not in masked] for key, values in data.items()}
        answer, condition = solve(exact, keep, digits, twin_error)
        size = max([abs(v) for v in exact["data"]["z"]]) or 1.0
        bound = dict(tolerance or {"prediction_abs": 1e-9 * size, "variance_abs": 1e-9 * total})
        bound["float32"] = {"prediction_abs": 1e-4 * size, "variance_abs": 1e-4 * total}
        if masked is not None:
            answer["weights"] = None
        case["expect"] = {"status": status, **answer, "tolerance": bound, "properties": properties}
        case["cond_double_estimate"] = condition
    if note:
        case["note"] = note

    def plain(v):
        if isinstance(v, dict):
            return {key: plain(value) for key, value in v.items()}
        if isinstance(v, list):
            return [plain(value) for value in v]
        if isinstance(v, float) and v != v:
            return "NaN"
        if isinstance(v, float) and v in (float("inf"), float("-inf")):
            return "Infinity" if v > 0 else "-Infinity"
        return v

    with open(os.path.join(FOLDER, name + ".json"), "w") as file:
        json.dump(plain(case), file, indent=1)
        file.write("\n")
    print(name, "condition %.2g" % case["cond_double_estimate"] if case["cond_double_estimate"] else "")


def pixels(*points):
    return {"x": [p[0] for p in points], "y": [p[1] for p in points]}


def shared_positions():
    """Two neighbouring cells whose windows overlap: the same Sobol positions, radiance of two estimates."""
    rng = random.Random(1)
    points = [(4 * a, 4 * b) for a, b in sobol(16)]
    x, y = [p[0] for p in points], [p[1] for p in points]
    x += [v for v in x[:10]]
    y += [v for v in y[:10]]
    x += [v + 4 for v in x[:6]]
    y += y[:6]
    return rng, x, y


def sobol_cases():
    rng, x, y = shared_positions()
    z = [shading(a, b, rng, 0.1) for a, b in zip(x, y)]
    v = [f32(0.002 + 0.03 * rng.random()) for _ in x]
    targets = pixels((0.5, 0.5), (2.0, 2.0), (x[3], y[3]), (5.5, 1.5), (40.0, 40.0))
    write("r01_sobol_shared", "Sobol positions shared by neighbouring cells, each estimate with its variance",
          "coincident data with different values: regular, because errors belong to the datum, not to its place",
          [structure("stable", 0.09, 3.0, 1.2)], {"x": x, "y": y, "z": z, "mevar": v}, targets, ALL)
    write("r02_sobol_shared_exact", "as r01 with no errors at all",
          "K is exactly singular; the limit of equal tiny errors averages the twins",
          [structure("stable", 0.09, 3.0, 1.2)], {"x": x, "y": y, "z": z}, targets, ALL, digits=240, twin_error=80)
    mixed = [0.0 if i % 3 == 0 else w for i, w in enumerate(v)]
    mixed[17] = 0.01
    write("r03_sobol_shared_some_exact", "as r01, every third estimate without error",
          "a twin without error wins, its noisy copy gets weight 0",
          [structure("stable", 0.09, 3.0, 1.2)], {"x": x, "y": y, "z": z, "mevar": mixed},
          pixels((0.5, 0.5), (2.0, 2.0), (5.5, 1.5)), ALL)
    subnormal = [1e-310 if i < 10 else 3e-310 if 16 <= i < 26 else w for i, w in enumerate(v)]
    write("r04_subnormal_errors", "as r01, twins whose error variances are subnormal: 1e-310 and 3e-310",
          "1/v overflows: merging must weigh them 3 to 1 by the ratio of variances",
          [structure("stable", 0.09, 3.0, 1.2)], {"x": x, "y": y, "z": z, "mevar": subnormal}, targets, ALL, digits=700)
    x, y = [], []
    for px in range(4):
        for _ in range(16):
            x.append(px + 0.5)
            y.append(0.5)
    z = [shading(a, b, rng, 0.2) for a, b in zip(x, y)]
    v = [f32(0.04 * rng.expovariate(1)) for _ in x]
    write("r05_replicates_at_centres", "no sample positions: 16 replicates at the centre of each of 4 pixels",
          "64 data at 4 places in a row; the answer is that of 4 weighted means",
          [structure("exponential", 0.04, 2.0)], {"x": x, "y": y, "z": z, "mevar": v},
          pixels((0.5, 0.5), (2.0, 0.5), (3.5, 0.5), (3.5, 3.5)), ALL)


def light_cases():
    rng = random.Random(2)
    x, y = grid(8, 8)
    z = [0.0] * 64
    v = [0.0] * 64
    z[27], v[27] = 500.0, 250000.0
    targets = pixels((3.5, 3.5), (4.0, 4.0), (0.5, 0.5), (7.9, 7.9))
    write("r06_lit_through_one_pixel", "a region lit through one pixel: 63 exact zeros, one 500 with its own variance",
          "the noisy light is outvoted by exact neighbours; predictions stay near 0 and no variance goes negative",
          [structure("exponential", 1000.0, 2.0)], {"x": x, "y": y, "z": z, "mevar": v}, targets,
          ALL + ["exact_at_data"])
    write("r07_black_region", "64 zeros without error", "prediction is 0, not 0/0", [structure("exponential", 1e-3, 2.0)],
          {"x": x, "y": y, "z": [0.0] * 64, "mevar": [0.0] * 64}, targets, ALL + ["exact_at_data"],
          tolerance={"prediction_abs": 1e-14, "variance_abs": 1e-12})
    x, y = grid(16, 16)
    z = [0.25] * 256
    z[137] = 1e6
    v = [1e-4] * 256
    v[137] = 1e12
    targets = pixels((x[137], y[137]), (8.0, 8.0), (0.5, 15.5))
    write("r08_firefly_256", "256 equal samples with one 1e6 firefly whose own error variance is 1e12",
          "the diagonal spans sixteen orders; the answer is 0.25 to 1e-5",
          [structure("stable", 0.01, 4.0, 1.5)], {"x": x, "y": y, "z": z, "mevar": v}, targets, ALL,
          tolerance={"prediction_abs": 1e-7, "variance_abs": 1e-11})
    write("r09_firefly_256_trusted", "as r08, but the firefly claims the error variance of the others",
          "garbage in: the answer is wild but exactly defined, and must not be hidden",
          [structure("stable", 0.01, 4.0, 1.5)],
          {"x": x, "y": y, "z": z, "mevar": [1e-4] * 256}, targets, ALL,
          tolerance={"prediction_abs": 1e-4, "variance_abs": 1e-11})
    x, y = grid(8, 8)
    z = [shading(a, b, rng, 0.05) for a, b in zip(x, y)]
    v = [0.0 if (i + i // 8) % 2 else 1e8 for i in range(64)]
    write("r10_errors_0_and_1e8", "a chequerboard of error variances 0 and 1e8",
          "exact at the exact pixels, and the others as if they were not there (to 1e-8)",
          [structure("exponential", 0.05, 3.0)], {"x": x, "y": y, "z": z, "mevar": v},
          pixels((1.5, 0.5), (0.5, 0.5), (4.0, 4.0), (20.0, 4.0)), ALL + ["exact_at_data"])
    z = [shading(a, b, rng, 0.0) if (i % 8) < 4 else f32(1e5 * (1 + 0.3 * rng.random())) for i, (a, b) in enumerate(zip(x, y))]
    v = [f32((0.1 * w) ** 2) for w in z]
    write("r11_light_edge", "the edge of a light: 0.6 beside 1e5, errors in proportion to the values",
          "weights rule over ten orders of error variance; the answer leans on the dark side",
          [structure("exponential", 1.0, 3.0)], {"x": x, "y": y, "z": z, "mevar": v},
          pixels((0.5, 0.5), (3.5, 3.5), (4.5, 3.5), (7.5, 7.5)), ALL,
          tolerance={"prediction_abs": 1e-5, "variance_abs": 1e-9})


def small_cases():
    s = [structure("exponential", 0.3, 2.0)]
    write("r12_one_sample", "a region with one sample, with error",
          "weight 1: no spread, no division by n - 1; the variance adds the error",
          s, {"x": [1.25], "y": [2.75], "z": [0.875], "mevar": [0.5]}, pixels((1.25, 2.75), (0.5, 0.5), (3.5, 3.5)),
          ALL, tolerance={"prediction_abs": 1e-14, "variance_abs": 1e-13})
    write("r13_two_samples_one_place", "two samples of one pixel at the same place",
          "inverse-variance mean; the direction between them does not exist",
          s, {"x": [1.25, 1.25], "y": [2.75, 2.75], "z": [0.25, 4.0], "mevar": [0.01, 1.0]},
          pixels((1.25, 2.75), (0.5, 0.5)), ALL, tolerance={"prediction_abs": 1e-13, "variance_abs": 1e-13})
    write("r14_three_samples_plane", "three samples, drift 1,x,y", "n = p: a plane through the data, no freedom left",
          s, {"x": [0.5, 2.5, 1.0], "y": [0.5, 0.75, 3.5], "z": [0.25, 1.0, 0.5], "mevar": [0.01, 0.02, 0.04]},
          pixels((0.5, 0.5), (1.5, 1.5), (3.5, 3.5)), DRIFT, kriging="universal", drift="1,x,y")
    write("r15_three_samples_on_line", "three samples on a line, drift 1,x,y, targets on the line",
          "rank 2: the third function cannot be told from the others, and need not be",
          s, {"x": [0.5, 1.5, 2.5], "y": [0.5, 1.5, 2.5], "z": [0.25, 1.0, 0.5], "mevar": [0.01, 0.02, 0.04]},
          pixels((1.0, 1.0), (3.5, 3.5)), BASIC + ["rank_deficiency_reported"], kriging="universal", drift="1,x,y",
          keep=[0, 1])
    write("r16_no_sample", "a region that no sample reached", "nothing to predict from", s,
          {"x": [], "y": [], "z": [], "mevar": []}, pixels((0.5, 0.5)), [], status="error")
    write("r17_two_samples_spherical", "two exact samples further apart than the range, target between",
          "independent data: weights 1/2", [structure("spherical", 0.3, 1.0)],
          {"x": [0.5, 3.5], "y": [0.5, 0.5], "z": [0.0, 1.0]}, pixels((2.0, 0.5), (0.5, 0.5), (1.0, 0.5)),
          ALL + ["exact_at_data"], tolerance={"prediction_abs": 1e-13, "variance_abs": 1e-13})


def shape_cases():
    rng = random.Random(3)
    x, y = grid(1, 32)
    z = [shading(a, b, rng, 0.1) for a, b in zip(x, y)]
    v = [f32(0.01 + 0.02 * rng.random()) for _ in x]
    s = [structure("stable", 0.05, 4.0, 1.5)]
    write("r18_width_1_image", "a 1 x 32 image, drift 1,x,y", "x is constant: a copy of the mean's column",
          s, {"x": x, "y": y, "z": z, "mevar": v}, pixels((0.5, 0.5), (0.5, 16.0), (0.5, 33.5)),
          BASIC + ["rank_deficiency_reported"], kriging="universal", drift="1,x,y", keep=[0, 2])
    write("r19_height_1_image_quadratic", "a 32 x 1 image, quadratic drift", "rank 3 of 6",
          s, {"x": y, "y": x, "z": z, "mevar": v}, pixels((0.5, 0.5), (16.0, 0.5), (31.5, 0.5)),
          BASIC + ["rank_deficiency_reported"], kriging="universal", drift="quadratic", keep=[0, 1, 3])
    x, y = grid(8, 8)
    z = [shading(a, b, rng, 0.1) for a, b in zip(x, y)]
    v = [f32(0.01 + 0.02 * rng.random()) for _ in x]
    near = [(0.5, 0.5), (4.25, 3.0), (8.0, 8.0)]
    offset = 65528.0
    for name, o, what in (("r20a_origin_quadratic", 0.0, "at the origin"),
                          ("r20b_65535_quadratic", offset, "at the far corner of a 65,536-pixel image")):
        write(name, "8 x 8 pixels %s, quadratic drift" % what,
              "r20a and r20b are one problem: centre coordinates before squaring them",
              s, {"x": [a + o for a in x], "y": [b + o for b in y], "z": z, "mevar": v},
              pixels(*[(a + o, b + o) for a, b in near]), BASIC, kriging="universal", drift="quadratic", digits=200)
    write("r21_65535_ordinary", "8 x 8 pixels at the far corner of a 65,536-pixel image, sub-pixel range",
          "distances of nearby large coordinates are exact only if subtracted first",
          [structure("exponential", 0.05, 0.37)],
          {"x": [a + offset for a in x], "y": [b + offset for b in y], "z": z, "mevar": v},
          pixels(*[(a + offset, b + offset) for a, b in near]), ALL)


def feature_cases():
    rng = random.Random(4)
    x, y = grid(8, 8)
    one = [1.0] * 64
    albedo = [f32(0.2 + 0.5 * ((i // 3) % 2) + 0.02 * rng.gauss(0, 1)) for i in range(64)]
    z = [f32(0.7 * a + 0.05 * rng.gauss(0, 1)) for a in albedo]
    v = [f32(0.002 + 0.002 * rng.random()) for _ in x]
    s = [structure("exponential", 0.01, 3.0)]
    at = pixels((0.5, 0.5), (3.0, 4.5), (7.5, 2.5))
    ta = [0.2, 0.45, 0.75]

    def columns(name, title, why, drift, drift0, keep=None, properties=DRIFT, tolerance=None, digits=120, mevar=v,
                note=None):
        write(name, title, why, s, {"x": x, "y": y, "z": z, "mevar": mevar, "drift": drift},
              {**at, "drift": drift0}, properties, kriging="universal", drift="columns", keep=keep, digits=digits,
              tolerance=tolerance, note=note)

    columns("r22_constant_features", "albedo 0.18 everywhere, normal (0,0,1): four constant columns",
            "rank 1 of 5: ordinary kriging", [one, [0.18] * 64, [0.0] * 64, [0.0] * 64, one],
            [[1.0] * 3, [0.18] * 3, [0.0] * 3, [0.0] * 3, [1.0] * 3], keep=[0],
            properties=BASIC + ["rank_deficiency_reported"])
    columns("r23_grey_albedo", "a grey surface: albedo R = G = B", "rank 2 of 4", [one, albedo, albedo, albedo],
            [[1.0] * 3, ta, ta, ta], keep=[0, 1], properties=BASIC + ["rank_deficiency_reported"])
    close = [a * (1 + 1e-6 * rng.gauss(0, 1)) for a in albedo]
    columns("r24_nearly_grey_albedo", "albedo R and G that differ by 1e-6 of themselves",
            "nearly collinear but not: both columns count, and six digits of the drift are lost",
            [one, albedo, close], [[1.0] * 3, ta, [t * (1 + 1e-6) for t in ta]],
            tolerance={"prediction_abs": 1e-8, "variance_abs": 1e-9})
    flat = [1.0 - abs(1e-7 * rng.gauss(0, 1)) for _ in x]
    columns("r25_almost_flat_wall", "a normal's z: 1 to within 1e-7, beside the column of ones",
            "the column minus its mean has seven digits fewer, and they matter", [one, flat],
            [[1.0] * 3, [1 - 1e-7, 1 - 2e-8, 1.0]], tolerance={"prediction_abs": 1e-7, "variance_abs": 1e-8})
    depth = [f32(1e6 + 40 * a + 3 * rng.gauss(0, 1)) for a in x]
    small = [f32(1e-6 * rng.random()) for _ in x]
    columns("r26_depth_1e6_albedo_1e-6", "depth of 1e6 beside an albedo of 1e-6 and raster coordinates",
            "columns twelve orders apart: scale before judging the rank",
            [one, [a - 4 for a in x], [b - 4 for b in y], depth, small],
            [[1.0] * 3, [-3.5, -1.0, 3.5], [-3.5, 0.5, -1.5], [1e6 + 20.0, 1e6 + 120.0, 1e6 + 300.0],
             [5e-7, 2e-7, 9e-7]])
    exact = [0.0 if i == 0 else w for i, w in enumerate(v)]
    columns("r27_exact_datum_with_features", "features, and a target on a datum without error",
            "exact interpolation holds with any drift", [one, albedo], [[1.0] * 3, [albedo[0]] + ta[1:]], mevar=exact,
            properties=DRIFT + ["exact_at_data"])
    edge = [0.0] * 64
    edge[63] = 1.0
    columns("r28_feature_of_one_pixel", "a feature that is 1 in one pixel and 0 elsewhere",
            "the drift absorbs that pixel: it must not leak into the others, nor its leverage break the variance",
            [one, edge], [[1.0] * 3, [0.0, 0.0, 1.0]])


def magnitude_cases():
    rng = random.Random(5)
    x, y = grid(6, 6)
    base = [shading(a, b, rng, 0.1) for a, b in zip(x, y)]
    v = [f32(0.004 + 0.02 * rng.random()) for _ in x]
    at = pixels((0.5, 0.5), (3.0, 3.25), (7.5, 6.5))
    for name, scale in (("r29a_radiance_1e-12", 1e-12), ("r29b_radiance_1e12", 1e12)):
        write(name, "a region of radiance about %g" % scale, "no absolute threshold may decide what is zero",
              [structure("stable", 0.05 * scale * scale, 3.0, 1.2)],
              {"x": x, "y": y, "z": [b * scale for b in base], "mevar": [w * scale * scale for w in v]}, at, ALL)
    z = [b * (1e-12 if i % 2 else 1e12) for i, b in enumerate(base)]
    mevar = [(0.1 * w) ** 2 if w else 1e-30 for w in z]
    write("r30_radiance_1e-12_and_1e12", "1e-12 and 1e12 side by side, errors a tenth of the values",
          "error variances from 1e-26 to 1e22 on one diagonal",
          [structure("exponential", 1e22, 2.0)], {"x": x, "y": y, "z": z, "mevar": mevar}, at, ALL)
    tiny = [b * 1e-308 for b in base]
    write("r31_subnormal_radiance", "radiance that is partly subnormal, sill 1e-310, errors subnormal",
          "products of two of these numbers are 0: scale by powers of two first",
          [structure("exponential", 1e-310, 3.0)],
          {"x": x, "y": y, "z": [t * 0.01 for t in tiny], "mevar": [w * 1e-310 for w in v]}, at, BASIC,
          tolerance={"prediction_abs": 1e-318, "variance_abs": 1e-318})
    bad = list(base)
    bad[7], bad[20] = float("nan"), float("inf")
    write("r32_nan_and_infinite_radiance", "a NaN and an infinite sample among 36",
          "renderers make them: an error, or the answer without them, never a NaN image",
          [structure("stable", 0.05, 3.0, 1.2)], {"x": x, "y": y, "z": bad, "mevar": v}, at, ["finite_or_error"],
          status="error_or_masked", masked=[7, 20])
    write("r33_range_1e6_pixels", "a 6 x 6 region of a smooth wall: range 1e6 pixels, errors 1e-8",
          "all semivariances are below 1e-5 of the sill: the covariance form loses their digits",
          [structure("exponential", 1.0, 1e6)], {"x": x, "y": y, "z": base, "mevar": [1e-8] * 36}, at, ALL,
          tolerance={"prediction_abs": 1e-8, "variance_abs": 1e-10, "prediction_abs_generalised": 1e-9,
                     "variance_rel_generalised": 1e-7})
    x, y = grid(12, 12)
    z = [f32(0.5 + 0.3 * (a / 12) ** 2 + 1e-3 * rng.gauss(0, 1)) for a in x]
    write("r34_defocus_gaussian", "a blurred 12 x 12 region: Gaussian model, range 10 pixels, error 1e-6",
          "smooth and dense: condition above 1e7, yet well determined thanks to the errors",
          [structure("gaussian", 0.04, 10.0)], {"x": x, "y": y, "z": z, "mevar": [1e-6] * 144},
          pixels((6.0, 6.0), (0.5, 0.5), (12.5, 6.0)), ALL, tolerance={"prediction_abs": 1e-9, "variance_abs": 1e-10})
    x, y = grid(8, 8)
    z = [f32(0.2 * rng.gauss(0, 1)) for _ in x]
    v = [f32(0.04 * rng.expovariate(1)) for _ in x]
    write("r35_residual_simple", "residuals of a region mean: simple kriging with mean 0, error per datum",
          "system (4) of the method: no constraint on the weights", [structure("stable", 0.02, 3.0, 0.7)],
          {"x": x, "y": y, "z": z, "mevar": v}, pixels((0.5, 0.5), (4.0, 4.0), (60.0, 60.0)),
          ["finite", "variance_nonneg", "within_tolerance"], kriging="simple", drift=None, mean=0.0)
    write("r36_nugget_and_errors", "a textured surface: nugget, two structures and errors, target on a noisy datum",
          "the nugget is the field's: a target on the datum's place sees it, the error it does not",
          [structure("spherical", 0.03, 3.0), structure("exponential", 0.02, 12.0)],
          {"x": x, "y": y, "z": z, "mevar": v}, pixels((0.5, 0.5), (4.0, 4.0), (3.5, 5.5)), ALL, nugget=0.015)


if __name__ == "__main__":
    sobol_cases()
    light_cases()
    small_cases()
    shape_cases()
    feature_cases()
    magnitude_cases()
