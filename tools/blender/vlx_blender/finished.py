"""Whether a picture is there and was made of the same file with the same options: its header says so (Note)."""

import hashlib
import os
import struct

ATTRIBUTE = b"Note"  # which Blender writes, and vlx-krige keeps


def digest(*parts):
    """Of texts and of what is in files, given as os.PathLike."""
    result = hashlib.blake2b(digest_size=16)
    for part in parts:
        one = hashlib.blake2b()
        if isinstance(part, os.PathLike):
            with open(part, "rb") as file:
                while block := file.read(1 << 20):
                    one.update(block)
        else:
            one.update(str(part).encode())
        result.update(one.digest())
    return result.hexdigest()


def note(path):
    """The attribute in the header of an OpenEXR file; empty if the file is none or has none."""
    def text(file):
        read = bytearray()
        while (byte := file.read(1)) not in (b"\0", b""):
            read += byte
        return bytes(read)
    try:
        with open(path, "rb") as file:
            if file.read(4) != b"\x76\x2f\x31\x01":
                return ""
            file.seek(4, os.SEEK_CUR)
            while name := text(file):
                text(file)  # its type
                size = struct.unpack("<i", file.read(4))[0]
                if size < 0:
                    break
                if name == ATTRIBUTE:
                    return file.read(size).decode(errors="replace")
                file.seek(size, os.SEEK_CUR)
    except (OSError, struct.error, ValueError):
        pass
    return ""
