#!/usr/bin/env python3
"""Draws what solver_bench printed: time against n, error against condition number, both log-log.

    build/release/bin/solver_bench > table.txt
    testdata/figures/plot_solver_cost.py table.txt testdata/figures/solver_cost.svg
"""
import math
import re
import sys

# name, colour, dashes, line width: coinciding lines are drawn one inside another
SERIES = [
    ("bare LLT", "#777777", "5 3", 2),
    ("double", "#1b5fa8", "", 1.6),
    ("float, refined", "#eda24f", "", 4.2),
    ("batched", "#86cf9f", "", 7),
    ("full-pivot LU, bordered", "#b3322e", "", 1.6),
]
NUMBER = r"[-+0-9.e]+"
WIDTH, HEIGHT = 960, 420
PANEL_WIDTH, PANEL_HEIGHT, TOP = 340, 290, 70
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def read(path):
    """(times, errors): rows of [x, value of each series]; times are those of the stable model."""
    times, errors, section = [], [], None
    for line in open(path, encoding="utf-8"):
        if line.startswith("error of the estimate"):
            section = "errors"
        elif "microseconds a system" in line:
            section = "times" if line.startswith("Stable") else None
        numbers = [float(x) for x in re.findall(NUMBER, re.sub(r"\([^)]*\)|\|", " ", line))] if re.match(r" *\d", line) else []
        if section == "times" and numbers:
            times.append(numbers)
        elif section == "errors" and numbers:  # error variance, condition, then estimate and variance of each solver
            errors.append([numbers[1]] + numbers[2::2])
    if not times or not errors:
        sys.exit(f"{path}: expected the tables that solver_bench prints")
    return times, sorted(errors)


class Panel:
    """Log-log axes with their frame, grid and labels."""

    def __init__(self, left, x_range, y_range):
        self.left = left
        self.x_range = [math.log10(v) for v in x_range]
        self.y_range = [math.log10(v) for v in y_range]
        self.svg = []

    def x(self, v):
        low, high = self.x_range
        return self.left + (math.log10(v) - low) / (high - low) * PANEL_WIDTH

    def y(self, v):
        low, high = self.y_range
        return TOP + PANEL_HEIGHT - (math.log10(v) - low) / (high - low) * PANEL_HEIGHT

    def text(self, x, y, text, anchor="middle", **attributes):
        more = "".join(f' {k.replace("_", "-")}="{v}"' for k, v in attributes.items())
        self.svg.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{text}</text>')

    def axes(self, title, x_label, y_label, x_ticks, y_ticks):
        bottom = TOP + PANEL_HEIGHT
        for v, label in x_ticks:
            x = self.x(v)
            self.svg.append(f'<path d="M{x:.1f} {TOP}V{bottom}" stroke="#e4e4e4"/>')
            self.text(x, bottom + 17, label)
        for v, label in y_ticks:
            y = self.y(v)
            self.svg.append(f'<path d="M{self.left} {y:.1f}h{PANEL_WIDTH}" stroke="#e4e4e4"/>')
            self.text(self.left - 7, y + 4, label, "end")
        self.svg.append(f'<rect x="{self.left}" y="{TOP}" width="{PANEL_WIDTH}" height="{PANEL_HEIGHT}" '
                        'fill="none" stroke="#999999"/>')
        self.text(self.left + PANEL_WIDTH / 2, TOP - 40, title, font_size=14, font_weight="bold")
        self.text(self.left + PANEL_WIDTH / 2, bottom + 38, x_label)
        middle = TOP + PANEL_HEIGHT / 2
        self.text(self.left - 52, middle, y_label, transform=f"rotate(-90 {self.left - 52} {middle})")

    def line(self, points, series):
        _, colour, dashes, width = series
        path = "M" + "L".join(f"{self.x(x):.1f} {self.y(y):.1f}" for x, y in points)
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        self.svg.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>')
        for x, y in points:
            self.svg.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="{1.8 + width / 2:.1f}" fill="{colour}"/>')


def power_ticks(low, high, step):
    return [(10.0**k, "10" + str(k).translate(SUPERSCRIPT)) for k in range(low, high + 1, step)]


def decades(values):
    return math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    times, errors = read(sys.argv[1])

    low, high = decades([v for row in times for v in row[1:]])
    left = Panel(80, (times[0][0] / 1.15, times[-1][0] * 1.15), (10.0**low, 10.0**high))
    left.axes("Time of one system", "number of data n", "microseconds (stable model, one core)",
              [(row[0], f"{row[0]:.0f}") for row in times], power_ticks(low, high, 1))
    for k, series in sorted(enumerate(SERIES), key=lambda e: -e[1][3]):
        left.line([(row[0], row[k + 1]) for row in times], series)

    low, high = decades([v for row in errors for v in row[1:]])
    x_low, x_high = decades([row[0] for row in errors])
    right = Panel(570, (10.0**x_low, 10.0**x_high), (10.0**low, 10.0**high))
    right.axes("Error of the estimate", "condition number of the covariance matrix", "largest error of 5 systems, n = 40",
               power_ticks(x_low, x_high, 2), power_ticks(low, high, 2))
    for k, series in sorted(enumerate(SERIES[1:]), key=lambda e: -e[1][3]):
        right.line([(row[0], row[k + 1]) for row in errors], series)

    legend, x = [], 80
    for name, colour, dashes, width in SERIES:
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        legend.append(f'<path d="M{x} {TOP - 18}h26" stroke="{colour}" stroke-width="{width}"{dash}/>'
                      f'<text x="{x + 32}" y="{TOP - 14}">{name}</text>')
        x += 60 + 7 * len(name)
    svg = "\n".join(left.svg + right.svg + legend)
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
                   f'font-family="sans-serif" font-size="12" fill="#222222">\n'
                   f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>\n{svg}\n</svg>\n')


main()
