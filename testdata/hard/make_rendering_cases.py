#!/usr/bin/env python3
"""Writes the r*.json cases: kriging systems as rendering makes them, solved in 80 digits (mpmath).

The bordered system is eliminated directly, from the exact values of the double inputs."""
import json
import math
import os
import random

from mpmath import mp, mpf, exp, sqrt, nstr

mp.dps = 80


def gamma(model, h):
    if h == 0:
        return mpf(0)
    total = mpf(model["nugget"])
    for s in model["structures"]:
        u = h / mpf(s["range"])
        if s["type"] == "exponential":
            rho = exp(-u)
        elif s["type"] == "gaussian":
            rho = exp(-u * u)
        elif s["type"] == "stable":
            rho = exp(-u ** mpf(s["alpha"]))
        else:
            rho = (1 - u) ** 2 * (1 + u / 2) if u < 1 else mpf(0)
        total += mpf(s["sill"]) * (1 - rho)
    return total


def eliminate(a, b):
    """Solves a x = b (lists of rows, b with several columns) with partial pivoting."""
    n, m = len(a), len(b[0])
    rows = [a[i] + b[i] for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        top = rows[k]
        for i in range(k + 1, n):
            if rows[i][k] != 0:
                f = rows[i][k] / top[k]
                rows[i][k + 1:] = [x - f * y for x, y in zip(rows[i][k + 1:], top[k + 1:])]
    x = [None] * n
    for i in reversed(range(n)):
        x[i] = [(rows[i][n + c] - sum(rows[i][j] * x[j][c] for j in range(i + 1, n))) / rows[i][i] for c in range(m)]
    return x


def drift_rows(kind, xs, ys, columns, use):
    if kind == "columns":
        full = [[mpf(column[i]) for column in columns] for i in range(len(xs))]
    else:
        full = [[mpf(1), mpf(x), mpf(y)] if kind == "1,x,y" else [mpf(1)] for x, y in zip(xs, ys)]
        if kind == "quadratic":
            full = [[mpf(1), mpf(x), mpf(y), mpf(x) ** 2, mpf(x) * mpf(y), mpf(y) ** 2] for x, y in zip(xs, ys)]
    return [[row[j] for j in use] for row in full] if use is not None else full


def solve(case, use):
    data, targets, model = case["data"], case["targets"], case["model"]
    x, y, z = data["x"], data["y"], data["z"]
    keep = [i for i in range(len(x)) if data.get("mevar", [0.0] * len(x))[i] != "Infinity"]
    sill = mpf(model["nugget"]) + sum(mpf(s["sill"]) for s in model["structures"])

    def covariance(ax, ay, bx, by):
        return sill - gamma(model, sqrt((mpf(ax) - mpf(bx)) ** 2 + (mpf(ay) - mpf(by)) ** 2))

    simple = case["kriging"] == "simple"
    f = drift_rows(case["drift"], x, y, data.get("drift"), use) if not simple else [[] for _ in x]
    f0 = drift_rows(case["drift"], targets["x"], targets["y"], targets.get("drift"), use) if not simple else None
    n, m = len(keep), len(targets["x"])
    p = len(f[keep[0]])
    a = [[covariance(x[i], y[i], x[j], y[j]) for j in keep] + f[i] for i in keep]
    for r, i in enumerate(keep):
        a[r][r] += mpf(model["error_nugget"]) + mpf(data["mevar"][i] if "mevar" in data else 0)
    a += [[f[i][k] for i in keep] + [mpf(0)] * p for k in range(p)]
    b = [[covariance(x[i], y[i], targets["x"][t], targets["y"][t]) for t in range(m)] for i in keep]
    b += [[f0[t][k] for t in range(m)] for k in range(p)]
    w = eliminate(a, b)
    mean = mpf(case["mean"]) if simple else mpf(0)
    out = {"prediction": [], "variance": [], "weights": []}
    for t in range(m):
        out["prediction"].append(mean + sum(w[r][t] * (mpf(z[i]) - mean) for r, i in enumerate(keep)))
        out["variance"].append(sill - sum(w[r][t] * b[r][t] for r in range(n + p)))
        row = [0.0] * len(x)
        for r, i in enumerate(keep):
            row[i] = float(w[r][t])
        out["weights"].append(row)
    return out


def write(name, title, why, x, y, z, targets, mevar=None, structures=None, nugget=0.0, error_nugget=0.0, drift="1",
          kriging=None, mean=None, columns=None, target_columns=None, use=None, status="ok", properties=(),
          prediction=1e-9, variance=1e-9, invariances=True, relative=False):
    data = {"x": x, "y": y, "z": z}
    if mevar is not None:
        data["mevar"] = mevar
    goals = {"x": [t[0] for t in targets], "y": [t[1] for t in targets]}
    if columns is not None:
        data["drift"], goals["drift"] = columns, target_columns
    structures = structures or [{"type": "exponential", "sill": 1.0, "range": 3.0}]
    case = {
        "id": name, "title": title, "why": why,
        "model": {"nugget": nugget, "error_nugget": error_nugget, "structures": structures},
        "kriging": kriging or ("ordinary" if drift == "1" else "universal"),
        "drift": drift, "mean": mean, "data": data, "targets": goals,
    }
    listed = ["finite", "variance_nonneg"] + list(properties)
    expect = {"status": status, "tolerance": {}, "properties": listed}
    if status != "error_or_fallback":
        answer = solve(case, use)
        tolerance = {"prediction_abs": prediction, "variance_abs": variance}
        if relative:
            tolerance = {"prediction_rel": prediction, "variance_rel": variance}
        listed += ["weights_sum", "within_tolerance"]
        if invariances:
            listed += ["permutation", "translation", "rotation", "affine_values"]
        expect.update({
            "prediction": [float(v) for v in answer["prediction"]],
            "prediction_40digits": [nstr(v, 40) for v in answer["prediction"]],
            "variance": [float(v) for v in answer["variance"]],
            "weights": answer["weights"], "tolerance": tolerance})
    case["expect"] = expect
    case["cond_double_estimate"] = None
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name + ".json")
    with open(path, "w") as file:
        json.dump(case, file, indent=1)
        file.write("\n")
    print(name)


def van_der_corput(i, base):
    value, scale = 0.0, 1.0 / base
    while i:
        value += (i % base) * scale
        i //= base
        scale /= base
    return value


def main():
    rng = random.Random(20)
    noise = lambda s=1.0: rng.gauss(0, s)
    stable = [{"type": "stable", "sill": 0.5, "range": 3.0, "alpha": 1.5}]

    def cell(n, size=8.0, x0=0.0, y0=0.0):
        return ([x0 + size * van_der_corput(i + 1, 2) for i in range(n)],
                [y0 + size * van_der_corput(i + 1, 3) for i in range(n)])

    def picture(x, y):
        return [math.sin(a / 3) + 0.2 * b for a, b in zip(x, y)]

    inside = [[2.5, 3.5], [7.5, 0.5], [4.0, 4.0]]

    x, y = cell(24)
    x, y = x + x[:12], y + y[:12]
    v = [rng.uniform(0.01, 0.1) for _ in x]
    write("r01_sobol_shared", "A low-discrepancy point set shared by two cells", "coincident data with different errors",
          x, y, [a + noise(0.2) for a in picture(x, y)], inside, v, stable)

    x, y = cell(64)
    lit = [1000.0 if abs(a - 2.5) < 0.5 and abs(b - 3.5) < 0.5 else 0.001 for a, b in zip(x, y)]
    write("r02_lit_pixel", "A dark region lit through one pixel", "values over six decades, errors proportional to them",
          x, y, lit, inside, [(0.3 * a) ** 2 for a in lit], stable, prediction=1e-8)

    x, y = cell(256, 4.0)
    z, v = [0.25] * 256, [1e-4] * 256
    z[100], v[100] = 1e6, 1e12
    write("r03_firefly_256", "256 equal samples and one firefly of 1e6", "its error variance removes it: the rest is constant",
          x, y, z, [[2.0, 2.0]], v, stable)

    x, y = cell(32)
    v = [0.0 if i % 2 else 1e8 for i in range(32)]
    write("r04_error_0_and_1e8", "Noise-free samples beside hopeless ones", "error variances 0 and 1e8",
          x, y, picture(x, y), inside, v, stable)

    write("r05_one_sample", "A region with one sample", "its value everywhere", [3.25], [1.5], [0.7],
          [[3.5, 1.5], [0.5, 0.5]], [0.01], stable)
    write("r06_two_samples", "A region with two samples", "closed form", [3.25, 1.0], [1.5, 6.0], [0.7, 0.1],
          [[3.5, 1.5], [0.5, 0.5]], [0.01, 0.04], stable)
    write("r07_three_samples_linear", "Three samples, three drift functions", "no degrees of freedom left: the plane through them",
          [3.25, 1.0, 6.5], [1.5, 6.0, 4.0], [0.7, 0.1, 0.4], [[3.5, 1.5], [4.5, 4.5]], [0.01] * 3, stable, drift="1,x,y",
          invariances=False)
    write("r08_two_samples_linear", "Two samples, three drift functions", "not determined: fallback, flagged",
          [3.25, 1.0], [1.5, 6.0], [0.7, 0.1], [[6.5, 7.5]], [0.01] * 2, stable, drift="1,x,y", status="error_or_fallback")

    x, y = [0.5] * 20, [0.5 + i for i in range(20)]
    column = [0.1 * i + noise(0.1) for i in range(20)]
    write("r09_one_pixel_wide", "A 1-pixel-wide image", "all x equal", x, y, column, [[0.5, 3.25], [0.5, 19.0]], [0.01] * 20, stable)
    write("r10_one_pixel_wide_linear", "A 1-pixel-wide image with drift 1,x,y", "x is constant: rank 2, estimable on the line",
          x, y, column, [[0.5, 3.25], [0.5, 19.0]], [0.01] * 20, stable, drift="1,x,y", use=[0, 2],
          properties=["rank_deficiency_reported"], invariances=False)

    x, y = cell(30)
    z = [a + noise(0.1) for a in picture(x, y)]
    v = [0.01] * 30
    albedo = [0.2 + 0.6 * (a > 4) + 0.01 * noise() for a in x]
    grey = lambda c: [[1.0] * len(c)] + [c]
    goal = lambda *c: [[1.0] * 3] + list(c)
    at = [0.21, 0.79, 0.5]
    write("r11_constant_feature", "External drift: albedo 0.18 everywhere", "dependent on the constant", x, y, z, inside, v, stable,
          drift="columns", columns=grey([0.18] * 30), target_columns=goal([0.18] * 3), use=[0],
          properties=["rank_deficiency_reported"], invariances=False)
    write("r12_duplicated_feature", "External drift: albedo twice", "rank 2 of 3", x, y, z, inside, v, stable, drift="columns",
          columns=grey(albedo) + [albedo], target_columns=goal(at, at), use=[0, 1],
          properties=["rank_deficiency_reported"], invariances=False)
    nearly = [a + 1e-6 * noise() for a in albedo]
    near_at = [a + 1e-6 * noise() for a in at]
    write("r13_nearly_collinear_features", "External drift: albedo and albedo + 1e-6 noise", "dependent but for six digits", x, y, z,
          inside, v, stable, drift="columns", columns=grey(albedo) + [nearly], target_columns=goal(at, near_at),
          properties=["drift_reproduced"], prediction=1e-7, variance=1e-7, invariances=False)
    depth = [1e7 if a > 6 else 5.0 + 0.1 * b for a, b in zip(x, y)]
    write("r14_sky_depth", "External drift: depth 5 or 1e7 (sky)", "a column over seven decades", x, y, z, inside, v, stable,
          drift="columns", columns=grey(depth), target_columns=goal([5.3, 1e7, 5.4]), properties=["drift_reproduced"], invariances=False)

    for name, scale in (("r15_radiance_1e-12", 1e-12), ("r16_radiance_1e12", 1e12)):
        s = scale * scale
        write(name, "Radiance of %g" % scale, "sill and errors scale with its square", x, y, [scale * a for a in z], inside,
              [0.01 * s] * 30, [{"type": "stable", "sill": 0.5 * s, "range": 3.0, "alpha": 1.5}], prediction=1e-9, variance=1e-9,
              relative=True)
    mixed = [1e12 if a > 4 else 1e-12 for a in x]
    write("r17_radiance_both", "Radiance of 1e-12 and 1e12 in one region", "errors proportional to the value, over 48 decades of variance",
          x, y, mixed, inside, [(0.1 * a) ** 2 for a in mixed], stable, prediction=1e-9, variance=1e-9, relative=True,
          invariances=False)

    x, y = cell(40, 8.0, 65528.0, 65527.0)
    z = [a + noise(0.1) for a in picture([a - 65528 for a in x], [b - 65527 for b in y])]
    far = [[65530.5, 65530.5], [65535.5, 65527.5]]
    write("r18_coordinates_65535_linear", "Image coordinates near 65,535, drift 1,x,y", "centre before powers are taken", x, y, z, far,
          [0.01] * 40, stable, drift="1,x,y", properties=["drift_reproduced"])
    write("r19_coordinates_65535_quadratic", "The same, quadratic drift", "1, x .. y^2 span ten decades uncentred", x, y, z, far,
          [0.01] * 40, stable, drift="quadratic", properties=["drift_reproduced"], prediction=1e-8, variance=1e-8)

    x, y = cell(16)
    z = [a + noise(0.1) for a in picture(x, y)]
    write("r20_subnormal", "Subnormal sill, errors and values", "the model is scaled before anything is multiplied", x, y,
          [1e-310 * a for a in z], inside, [1e-312] * 16, [{"type": "exponential", "sill": 1e-310, "range": 3.0}], prediction=1e-6,
          variance=1e-6, relative=True, invariances=False)
    write("r21_subnormal_coordinates", "Coordinates of 1e-310", "differences and ranges are scaled first", [1e-310 * a for a in x],
          [1e-310 * b for b in y], z, [[2.5e-310, 3.5e-310]], [0.01] * 16, [{"type": "exponential", "sill": 1.0, "range": 3e-310}],
          prediction=1e-7, variance=1e-7, invariances=False)

    x, y = cell(48, 4.0)
    z = [1 + 1e-3 * noise() for _ in x]
    write("r22_flat_wall", "A flat wall: range 1e6 pixels", "sill - gamma would lose six digits", x, y, z, [[2.0, 2.0], [0.1, 3.9]],
          [1e-6] * 48, [{"type": "exponential", "sill": 1.0, "range": 1e6}], prediction=1e-10, variance=1e-12)
    v = [10 ** rng.uniform(-6, 6) for _ in x]
    write("r23_adaptive_errors_linear", "Adaptive sampling: error variances 1e-6 to 1e6, drift 1,x,y", "equilibration with drift",
          x, y, z, [[2.0, 2.0], [0.1, 3.9]], v, stable, drift="1,x,y", properties=["drift_reproduced"], prediction=1e-8, variance=1e-8,
          invariances=False)
    masked = [("Infinity" if i % 3 == 0 else 0.01) for i in range(48)]
    write("r24_infinite_errors", "Every third sample missing: infinite error variance", "ignored, the answer of the others", x, y, z,
          [[2.0, 2.0], [0.1, 3.9]], masked, stable, status="error_or_masked", properties=["finite_or_error"], invariances=False)
    write("r25_black", "A black region: all values 0", "0 exactly; the variance does not depend on values", x[:20], y[:20], [0.0] * 20,
          [[2.0, 2.0], [0.1, 3.9]], [0.01] * 20, stable)
    write("r26_smooth_shading", "Gaussian model, 36 samples, error variance 1e-10", "condition number 1e11", *cell(36, 4.0),
          [math.sin(a) for a in cell(36, 4.0)[0]], [[2.0, 2.0], [0.1, 3.9]], [1e-10] * 36,
          [{"type": "gaussian", "sill": 1.0, "range": 6.0}], prediction=1e-7, variance=1e-9, invariances=False)


main()
