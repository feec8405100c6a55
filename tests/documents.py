#!/usr/bin/env python3
"""Fails when a relative link or picture in a Markdown file leads nowhere, a heading that a link names is missing, a document names a
path of one machine, or the front page outgrows 150 lines or 12 KB.

Usage: documents.py [FOLDER]      (default: this repository; files that git knows, or all but build folders without git)
"""

import os
import re
import subprocess
import sys
import urllib.parse

MOST_LINES, MOST_BYTES = 150, 12 * 1024
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")


def documents(root):
    """Markdown files, relative to the root."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", "*.md"], stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL, text=True)
    if listed.returncode == 0:
        return sorted(name for name in listed.stdout.splitlines() if os.path.exists(os.path.join(root, name)))
    found = []
    for folder, folders, files in os.walk(root):
        folders[:] = [f for f in folders if f not in ("build", ".git", ".cache")]
        found += [os.path.relpath(os.path.join(folder, f), root) for f in files if f.endswith(".md")]
    return sorted(found)


def prose(path):
    """The text without code, whose brackets are no links."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"^```.*?^```", "", file.read(), flags=re.S | re.M)
    text = "\n".join("" if line.startswith("    ") else line for line in text.splitlines())
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(path):
    """What GitHub calls the headings of a file."""
    with open(path, encoding="utf-8") as file:
        headings = re.findall(r"^#+ +(.*?)\s*$", file.read(), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken_links(root, name):
    path = os.path.join(root, name)
    for target in LINK.findall(prose(path)):
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            continue
        file, _, anchor = urllib.parse.unquote(target).partition("#")
        to = os.path.normpath(os.path.join(os.path.dirname(path), file)) if file else path
        if os.path.isabs(file) or not (to + os.sep).startswith(root + os.sep):
            yield f"{name}: {target} leads out of the repository"
        elif not os.path.exists(to):
            yield f"{name}: {target} is not there"
        elif anchor and to.endswith(".md") and anchor not in anchors(to):
            yield f"{name}: {target}: no such heading"


def machine_paths(root, name):
    """Folders that a reader's machine has not; /usr and the like are everyone's, /tmp is where anyone may write."""
    with open(os.path.join(root, name), encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            for path in re.findall(r"(?<![\w.$}])/(?:work|home|root|Users)/[^\s`)]*", line):
                yield f"{name}:{number}: {path} is a path of one machine"


def main():
    root = os.path.realpath(sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(__file__), ".."))
    names = documents(root)
    faults = [fault for name in names for check in (broken_links, machine_paths) for fault in check(root, name)]
    with open(os.path.join(root, "README.md"), "rb") as file:
        text = file.read()
    if text.count(b"\n") > MOST_LINES:
        faults.append(f"README.md: expected at most {MOST_LINES} lines, found {text.count(bytes([10]))}")
    if len(text) > MOST_BYTES:
        faults.append(f"README.md: expected at most {MOST_BYTES} bytes, found {len(text)}")
    for fault in faults:
        print(fault)
    print(f"{len(names)} documents, {len(faults)} faults")
    sys.exit(1 if faults or not names else 0)


if __name__ == "__main__":
    main()
