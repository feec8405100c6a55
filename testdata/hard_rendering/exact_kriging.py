"""Kriging in extended precision, straight from the textbook, independent of the library.

Every double is taken as the exact number it is. With K = C + diag(errors), F the drift:
    beta = (F'K^-1 F)^-1 F'K^-1 z,   w = K^-1 (c0 + F m),   m = (F'K^-1 F)^-1 (f0 - F'K^-1 c0),
    prediction w'z,   variance C00 - 2 w'c0 + w'K w
(Chiles and Delfiner, Geostatistics, 2nd ed., ch. 3.4). A nugget belongs to the field: two points with equal
coordinates share it. Errors are on the diagonal by datum index only.
"""
from mpmath import mp, mpf


def distance(ax, ay, bx, by):
    return mp.sqrt((ax - bx) ** 2 + (ay - by) ** 2)


def correlation(structure, h):
    if h == 0:
        return mpf(1)
    u = h / mpf(structure["range"])
    kind = structure["type"]
    if kind == "exponential":
        return mp.exp(-u)
    if kind == "gaussian":
        return mp.exp(-u * u)
    if kind == "stable":
        return mp.exp(-(u ** mpf(structure["alpha"])))
    if kind == "spherical":
        return 1 - mpf(3) / 2 * u + u ** 3 / 2 if u < 1 else mpf(0)
    raise ValueError(kind)


def covariance(model, h):
    c = mpf(model["nugget"]) if h == 0 else mpf(0)
    for s in model["structures"]:
        if s["sill"]:
            c += mpf(s["sill"]) * correlation(s, h)
    return c


def dot(a, b):
    return mp.fdot(zip(a, b))


def cholesky(k):
    """Rows of the lower factor."""
    rows = []
    for i, row in enumerate(k):
        new = []
        for j in range(i):
            new.append((row[j] - dot(new, rows[j][:j])) / rows[j][j])
        pivot = row[i] - dot(new, new)
        if not pivot > 0:
            raise ArithmeticError("not positive definite: pivot %s in row %d" % (mp.nstr(pivot, 5), i))
        new.append(mp.sqrt(pivot))
        rows.append(new)
    return rows


def forward(rows, b):
    x = []
    for i, row in enumerate(rows):
        x.append((b[i] - dot(row[:i], x)) / row[i])
    return x


def backward(columns, b):
    """`columns[i]`: entries i.. of column i of the lower factor."""
    n = len(b)
    x = [mpf(0)] * n
    for i in range(n - 1, -1, -1):
        x[i] = (b[i] - dot(columns[i][1:], x[i + 1:])) / columns[i][0]
    return x


def drift_functions(case, which):
    """Columns of F, or of f0, of all the case's drift functions, in the order of the format."""
    points = case[which]
    x, y = [mpf(v) for v in points["x"]], [mpf(v) for v in points["y"]]
    one = [mpf(1)] * len(x)
    drift = case["drift"]
    if case["kriging"] == "simple":
        return []
    if drift == "1":
        return [one]
    if drift == "1,x,y":
        return [one, x, y]
    if drift == "quadratic":
        return [one, x, y, [a * a for a in x], [a * b for a, b in zip(x, y)], [b * b for b in y]]
    return [[mpf(v) for v in column] for column in points["drift"]]


def check_estimable(f, f0, keep):
    """Dropped drift columns must be combinations of the kept ones, at the targets too."""
    for k in range(len(f)):
        if k in keep:
            continue
        p = len(keep)
        gram = mp.matrix(p, p)
        right = mp.matrix(p, 1)
        for i in range(p):
            right[i] = dot(f[keep[i]], f[k])
            for j in range(p):
                gram[i, j] = dot(f[keep[i]], f[keep[j]])
        a = mp.lu_solve(gram, right)
        for points in (f, f0):
            for t in range(len(points[k])):
                rest = points[k][t] - sum(a[i] * points[keep[i]][t] for i in range(p))
                assert abs(rest) <= mpf(10) ** (-mp.dps // 2), "dropped drift column is not a combination"


def condition(k, rows, columns):
    """2-norm condition number by power and inverse iteration."""
    n = len(k)
    if n == 1:
        return 1.0
    full = [[k[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]

    def iterate(apply):
        v = [mpf((i * 7919) % 101 + 1) for i in range(n)]
        size = mpf(1)
        for _ in range(25):
            v = apply(v)
            size = mp.sqrt(dot(v, v))
            v = [a / size for a in v]
        return size

    digits = mp.dps
    if n > 100:
        mp.dps = 50
    largest = iterate(lambda v: [dot(row, v) for row in full])
    smallest = 1 / iterate(lambda v: backward(columns, forward(rows, v)))
    mp.dps = digits
    return float(largest / smallest)


def solve(case, keep=None, digits=120, twin_error=None):
    """Fills case["expect"]'s numbers. `keep`: the drift columns of a basis, if they are dependent.
    `twin_error`: the equal error given to every datum, in the limit, where coincident data without error
    make K singular."""
    mp.dps = digits
    model, data, targets = case["model"], case["data"], case["targets"]
    x, y = [mpf(v) for v in data["x"]], [mpf(v) for v in data["y"]]
    z = [mpf(v) for v in data["z"]]
    n = len(x)
    error = [mpf(model["error_nugget"]) + (mpf(data["mevar"][i]) if "mevar" in data else 0) for i in range(n)]
    if twin_error:
        error = [e + mpf(10) ** -twin_error for e in error]
    k = []
    for i in range(n):
        k.append([covariance(model, distance(x[i], y[i], x[j], y[j])) for j in range(i)])
        k[i].append(covariance(model, mpf(0)) + error[i])
    rows = cholesky(k)
    columns = [[rows[i][j] for i in range(j, n)] for j in range(n)]
    f, f0 = drift_functions(case, "data"), drift_functions(case, "targets")
    keep = list(range(len(f))) if keep is None else keep
    check_estimable(f, f0, keep)
    f, f0 = [f[i] for i in keep], [f0[i] for i in keep]
    p = len(f)
    a = [forward(rows, column) for column in f]
    mean = mpf(case["mean"]) if case["kriging"] == "simple" else mpf(0)
    white = forward(rows, [v - mean for v in z])
    beta, inverse = None, None
    if p:
        gram = mp.matrix(p, p)
        for i in range(p):
            for j in range(p):
                gram[i, j] = dot(a[i], a[j])
        inverse = gram ** -1
        right = [dot(column, white) for column in a]
        beta = [sum(inverse[i, j] * right[j] for j in range(p)) for i in range(p)]
    answer = {"prediction": [], "prediction_40digits": [], "variance": [], "sum_abs_weights": [], "weights": []}
    for t in range(len(targets["x"])):
        tx, ty = mpf(targets["x"][t]), mpf(targets["y"][t])
        c0 = [covariance(model, distance(x[i], y[i], tx, ty)) for i in range(n)]
        b = forward(rows, c0)
        if p:
            gap = [f0[j][t] - dot(a[j], b) for j in range(p)]
            m = [sum(inverse[i, j] * gap[j] for j in range(p)) for i in range(p)]
            b2 = [b[i] + sum(a[j][i] * m[j] for j in range(p)) for i in range(n)]
        else:
            b2 = b
        w = backward(columns, b2)
        # |L'w|^2 = w'Kw.
        variance = covariance(model, mpf(0)) - 2 * dot(w, c0) + dot(b2, b2)
        prediction = mean + dot(w, [v - mean for v in z])
        scale = covariance(model, mpf(0)) or mpf(1)
        if abs(variance) < scale * mpf(10) ** (-(twin_error or digits) // 2):
            variance = mpf(0)
        if abs(prediction) < max(abs(v) for v in z) * mpf(10) ** (-(twin_error or digits) // 2):
            prediction = mpf(0)
        answer["prediction"].append(float(prediction))
        answer["prediction_40digits"].append(mp.nstr(prediction, 40))
        answer["variance"].append(float(variance))
        answer["sum_abs_weights"].append(float(sum(abs(v) for v in w)))
        tiny = mpf(10) ** -60
        answer["weights"].append([0.0 if abs(v) < tiny else float(v) for v in w])
    answer["beta"] = [float(v) for v in beta] if p else None
    answer["beta_variance"] = [float(inverse[i, i]) for i in range(p)] if p else None
    answer["digits_used"] = digits
    if twin_error or len(keep) < len(drift_functions(case, "data")) or n > 100:
        answer["weights"] = None
    return answer, condition(k, rows, columns)
