#!/usr/bin/env python3
"""Draws what solver_bench printed: time against n, error against condition number, both log-log.

    build/release/bin/solver_bench > table.txt
    testdata/figures/plot_solver_cost.py table.txt testdata/figures/solver_cost.svg
"""
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../tools"))
from chart import Panel, decades, legend, power_ticks, write  # noqa: E402

# name, colour, dashes, line width: coinciding lines are drawn one inside another
SERIES = [
    ("bare LLT", "#777777", "5 3", 2),
    ("double", "#1b5fa8", "", 1.6),
    ("float, refined", "#eda24f", "", 4.2),
    ("full-pivot LU, bordered", "#b3322e", "", 1.6),
]
NUMBER = r"[-+0-9.e]+"


def read(path):
    """(times, errors): rows of [x, value of each series]; times are those of the stable model."""
    times, errors, section = [], [], None
    for line in open(path, encoding="utf-8"):
        if line.startswith("error of the estimate"):
            section = "errors"
        elif "microseconds a system" in line:
            section = "times" if line.startswith("Stable") else None
        elif "milliseconds a system" in line:  # of more digits: not drawn
            section = None
        numbers = [float(x) for x in re.findall(NUMBER, re.sub(r"\([^)]*\)|\|", " ", line))] if re.match(r" *\d", line) else []
        if section == "times" and numbers:
            times.append(numbers)
        elif section == "errors" and numbers:  # error variance, condition, then estimate and variance of each solver
            errors.append([numbers[1]] + numbers[2::2])
    if not times or not errors:
        sys.exit(f"{path}: expected the tables that solver_bench prints")
    return times, sorted(errors)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    times, errors = read(sys.argv[1])

    low, high = decades([v for row in times for v in row[1:]])
    left = Panel(80, (times[0][0] / 1.15, times[-1][0] * 1.15), (10.0**low, 10.0**high))
    left.axes("Time of one system", "number of data n", "microseconds (stable model, one core)",
              [(row[0], f"{row[0]:.0f}") for row in times], power_ticks(low, high, 1))
    for k, series in sorted(enumerate(SERIES), key=lambda e: -e[1][3]):
        left.line([(row[0], row[k + 1]) for row in times], *series[1:])

    low, high = decades([v for row in errors for v in row[1:]])
    x_low, x_high = decades([row[0] for row in errors])
    right = Panel(570, (10.0**x_low, 10.0**x_high), (10.0**low, 10.0**high))
    right.axes("Error of the estimate", "condition number of the covariance matrix", "largest error of 5 systems, n = 40",
               power_ticks(x_low, x_high, 2), power_ticks(low, high, 2))
    for k, series in sorted(enumerate(SERIES[1:]), key=lambda e: -e[1][3]):
        right.line([(row[0], row[k + 1]) for row in errors], *series[1:])

    write(sys.argv[2], 960, 420, left.svg + right.svg + legend(80, SERIES))


main()
