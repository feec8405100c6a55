#!/usr/bin/env python3
"""Which room may include which, and how large rooms and files may be: the house, kept.  usage: includes.py PROJECT

Rooms are the folders of src and include/variolux; a header of include/variolux/X belongs to room X."""
import os
import re
import sys

MAY = {  # room: rooms whose headers it may include, besides its own
    'base': set(),
    'geostat': {'base'},
    'exr': {'base'},
    'dump': {'base', 'exr'},
    'import': {'base', 'exr', 'dump'},
    'edit': {'base', 'exr', 'dump'},
    'reconstruct': {'base', 'dump', 'geostat'},
    'compare': {'base'},
    'render': {'base', 'dump'},
}
MOST_LINES = 400   # of a file of src, include or tools
MOST_SOURCES = 30  # of a folder
APART = [('reconstruct/paper', 'reconstruct/drift')]  # neither includes the other

include = re.compile(r'^\s*#include "([^"]+)"', re.M)


def room_of(path):
    """Of a header as it is included, or of a file relative to src or include."""
    parts = path.split('/')
    return parts[1] if parts[0] == 'variolux' else parts[0]


def faults(project):
    for root in ('src', 'include'):
        for folder, _, names in os.walk(os.path.join(project, root)):
            sources = [name for name in names if name.endswith(('.h', '.cpp'))]
            for name in sources:
                path = os.path.join(folder, name)
                relative = os.path.relpath(path, os.path.join(project, root))
                room = room_of(relative)
                if room not in MAY:
                    yield f'{path}: expected a room of {sorted(MAY)}, found {room}'
                    continue
                with open(path, encoding='utf-8') as file:
                    text = file.read()
                for header in include.findall(text):
                    if '/' not in header and os.path.exists(os.path.join(folder, header)):
                        continue
                    other = room_of(header)
                    if other != room and other not in MAY[room]:
                        yield f'{path}: {room} includes {header}; it may include {sorted(MAY[room])}'
                    for one, two in APART:
                        for here, there in ((one, two), (two, one)):
                            if relative.startswith(here + '/') and header.startswith(there + '/'):
                                yield f'{path}: {here} includes {header}; they are apart'


def sizes(project):
    for root in ('src', 'include', 'tools'):
        for folder, _, names in os.walk(os.path.join(project, root)):
            if '__pycache__' in folder:
                continue
            sources = [name for name in names if name.endswith(('.h', '.cpp'))]
            if len(sources) > MOST_SOURCES:
                yield f'{folder}: expected at most {MOST_SOURCES} sources, found {len(sources)}'
            for name in names:
                with open(os.path.join(folder, name), encoding='utf-8') as file:
                    text = file.read()
                lines = text.count('\n')
                if lines > MOST_LINES:
                    yield f'{os.path.join(folder, name)}: expected at most {MOST_LINES} lines, found {lines}'
                if name.endswith(('.h', '.cpp')) and '<OpenImageIO/' in text and name != 'openimageio.cpp':
                    yield f'{os.path.join(folder, name)}: includes OpenImageIO, which only the module may'


if __name__ == '__main__':
    found = [*faults(sys.argv[1]), *sizes(sys.argv[1])]
    print('\n'.join(found) if found else 'the house is kept')
    sys.exit(1 if found else 0)
