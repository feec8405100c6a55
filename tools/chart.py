"""Charts as SVG, log-log unless told, for the project's tools and figures. Python 3 and its standard library only."""

import math

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
TOP = 70
COLOURS = ("#1b5fa8", "#b3322e", "#eda24f", "#4a9f62", "#777777")


def decades(values):
    """The powers of ten that enclose positive values: two at least."""
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return low, max(high, low + 1)


def power_ticks(low, high, step=1):
    return [(10.0**k, "10" + str(k).translate(SUPERSCRIPT)) for k in range(low, high + 1, step)]


class Panel:
    """Axes with their frame, grid and labels: logarithmic but those named in `linear` ("x", "y", "xy")."""

    def __init__(self, left, x_range, y_range, width=340, height=290, linear=""):
        self.left, self.width, self.height = left, width, height
        self.x_scale, self.y_scale = (float if axis in linear else math.log10 for axis in "xy")
        self.x_range = [self.x_scale(v) for v in x_range]
        self.y_range = [self.y_scale(v) for v in y_range]
        self.svg = []

    def x(self, v):
        low, high = self.x_range
        return self.left + (self.x_scale(v) - low) / (high - low) * self.width

    def y(self, v):
        low, high = self.y_range
        return TOP + self.height - (self.y_scale(v) - low) / (high - low) * self.height

    def text(self, x, y, text, anchor="middle", **attributes):
        more = "".join(f' {k.replace("_", "-")}="{v}"' for k, v in attributes.items())
        self.svg.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{text}</text>')

    def axes(self, title, x_label, y_label, x_ticks, y_ticks):
        bottom = TOP + self.height
        for v, label in x_ticks:
            x = self.x(v)
            self.svg.append(f'<path d="M{x:.1f} {TOP}V{bottom}" stroke="#e4e4e4"/>')
            self.text(x, bottom + 17, label)
        for v, label in y_ticks:
            y = self.y(v)
            self.svg.append(f'<path d="M{self.left} {y:.1f}h{self.width}" stroke="#e4e4e4"/>')
            self.text(self.left - 7, y + 4, label, "end")
        self.svg.append(f'<rect x="{self.left}" y="{TOP}" width="{self.width}" height="{self.height}" '
                        'fill="none" stroke="#999999"/>')
        self.text(self.left + self.width / 2, TOP - 40, title, font_size=14, font_weight="bold")
        self.text(self.left + self.width / 2, bottom + 38, x_label)
        middle = TOP + self.height / 2
        self.text(self.left - 52, middle, y_label, transform=f"rotate(-90 {self.left - 52} {middle})")

    def line(self, points, colour, dashes="", width=1.6):
        path = "M" + "L".join(f"{self.x(x):.1f} {self.y(y):.1f}" for x, y in points)
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        self.svg.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>')
        for x, y in points:
            self.dot(x, y, colour, 1.8 + width / 2)

    def dot(self, x, y, colour, radius=3.5):
        self.svg.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="{radius:.1f}" fill="{colour}"/>')


def legend(left, entries):
    """Entries: (name, colour, dashes, line width), side by side above the panels."""
    svg, x = [], left
    for name, colour, dashes, width in entries:
        dash = f' stroke-dasharray="{dashes}"' if dashes else ""
        svg.append(f'<path d="M{x} {TOP - 18}h26" stroke="{colour}" stroke-width="{width}"{dash}/>'
                   f'<text x="{x + 32}" y="{TOP - 14}">{name}</text>')
        x += 60 + 7 * len(name)
    return svg


def write(path, width, height, svg):
    with open(path, "w", encoding="utf-8") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
                   f'font-family="sans-serif" font-size="12" fill="#222222">\n'
                   f'<rect width="{width}" height="{height}" fill="#ffffff"/>\n' + "\n".join(svg) + "\n</svg>\n")
