"""Channels of flat OpenEXR files by Python's standard library alone: scan lines, no compression or ZIP, as Blender and vlx-krige
write them."""

import itertools
import struct
import zlib


def unpacked(data, size):
    """ZIP's bytes: differences, of which the even ones come first."""
    if len(data) == size:
        return data
    data = bytearray(zlib.decompress(data))
    data = bytes(itertools.accumulate(data, lambda before, step: (before + step - 128) & 255))
    half = (len(data) + 1) // 2
    result = bytearray(len(data))
    result[0::2], result[1::2] = data[:half], data[half:]
    return bytes(result)


def read(path):
    """{channel: values, row by row}, {attribute: its bytes}."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:4] == b"\x76\x2f\x31\x01", path
    at = 8

    def text():
        nonlocal at
        end = data.index(b"\0", at)
        result, at = data[at:end].decode(), end + 1
        return result

    attributes = {}
    while name := text():
        text()
        size = struct.unpack_from("<i", data, at)[0]
        attributes[name], at = data[at + 4:at + 4 + size], at + 4 + size
    channels, rest = [], attributes["channels"]
    while rest[0]:
        name, rest = rest.split(b"\0", 1)
        channels.append((name.decode(), {1: "e", 2: "f"}[struct.unpack_from("<i", rest)[0]]))
        rest = rest[16:]
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    rows = {0: 1, 2: 1, 3: 16}[attributes["compression"][0]]
    values = {name: [] for name, _ in channels}
    line = sum(width * struct.calcsize(kind) for _, kind in channels)
    for place in struct.unpack_from(f"<{-(-height // rows)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, place)
        count = min(rows, y1 + 1 - y)
        block, p = unpacked(data[place + 8:place + 8 + size], line * count), 0
        for _ in range(count):
            for name, kind in channels:
                values[name] += struct.unpack_from(f"<{width}{kind}", block, p)
                p += width * struct.calcsize(kind)
    return values, attributes
