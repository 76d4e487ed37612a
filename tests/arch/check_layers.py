#!/usr/bin/env python3
"""Holds the project to its architecture: who may include whom, how includes are written, how large a file may be.

Usage: check_layers.py ROOT. Prints one line a violation, FILE:LINE: what is wrong, and exits with 1 where there is one.
"""

import os
import pathlib
import re
import sys

# Each folder and the folders it may include besides itself. Nothing is implied: what is not here is forbidden.
ALLOWED = {
    "core": set(),
    "config": {"core"},
    "drivers": {"core", "config"},
    "detect": {"core", "config"},
    "slam": {"core", "config", "messages"},  # a map file's records are messages (slam/map_io.h)
    "messages": set(),
    "daemon": {"core", "config", "drivers", "detect", "slam", "messages"},
    "tools": {"core", "config", "drivers", "detect", "slam", "messages", "daemon"},
    "models": set(),  # training code: part of no program
    "examples": {"messages"},  # for subscribers: what is installed, and nothing else of ours
    "tests": {"core", "config", "drivers", "detect", "slam", "messages", "daemon", "tools"},
}
GENERATED = "posed"  # <posed/pose_t.hpp>: generated from messages/*.lcm, so it belongs to that folder

MAX_LINES = {".h": 150, ".cpp": 450}
# Files that may be longer, each with the reason: {"folder/file.cpp": (lines, "why")}.
LARGER_FILES = {}

SOURCE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".c"}
# What the build, git and editors leave in a working tree.
SKIPPED = {".cache", ".git", "__pycache__", "build", "compile_commands.json", "shared"}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
# A path below a folder that only one machine has; these are written in pieces so that this file does not accuse itself.
MACHINE_PATH = re.compile(r"(?<![\w.~$}/])/(?:" + "|".join(["wo" + "rk", "ho" + "me", "ro" + "ot"]) + r")/[\w.-]+")


def text_files(root):
    """(path relative to root, lines) of every text file that belongs to the project."""
    for folder, subfolders, names in os.walk(root):
        subfolders[:] = sorted(set(subfolders) - SKIPPED)
        for name in sorted(set(names) - SKIPPED):
            path = pathlib.Path(folder) / name
            if path.is_file() and not path.is_symlink():
                content = path.read_bytes()
                if b"\0" not in content:
                    yield path.relative_to(root), content.decode("utf-8", errors="replace").splitlines()


def check_include(folder, quote, target, root):
    """What is wrong with one include of a file in `folder`, or None."""
    first = target.split("/")[0]
    if quote == "<":
        if first == GENERATED and folder != "messages" and "messages" not in ALLOWED[folder]:
            return f"{folder} must not include the generated message <{target}>"
        if first in ALLOWED and (root / target).is_file():
            return f'<{target}> is the project\'s own: write "{target}"'
        return None
    if first not in ALLOWED or "/" not in target or ".." in target.split("/"):
        return f'"{target}": write includes from the root of the repository ("folder/file.h")'
    if first != folder and first not in ALLOWED[folder]:
        return f'{folder} must not include "{target}"'
    if not (root / target).is_file():
        return f'"{target}" does not exist'
    return None


def check_source(relative, lines, root):
    folder = relative.parts[0]
    if folder not in ALLOWED:
        yield 1, f"sources belong in one of the folders {', '.join(ALLOWED)}"
        return
    for number, line in enumerate(lines, 1):
        match = INCLUDE.match(line)
        if match:
            problem = check_include(folder, match.group(1), match.group(2), root)
            if problem:
                yield number, problem
    if relative.suffix in {".h", ".hpp"} and "#pragma once" not in lines:
        yield 1, "no #pragma once"
    limit = MAX_LINES.get(relative.suffix)
    name = relative.as_posix()
    if name in LARGER_FILES:
        limit = LARGER_FILES[name][0]
    if limit and len(lines) > limit:
        yield len(lines), f"{len(lines)} lines, {limit} are allowed"


def check_text(lines):
    for number, line in enumerate(lines, 1):
        match = MACHINE_PATH.search(line)
        if match:
            yield number, f"{match.group(0)}: a path that only one machine has"


def check(root):
    """All violations below `root` as (file, line, message), and the number of sources looked at."""
    problems = []
    sources = 0
    for relative, lines in text_files(root):
        found = list(check_text(lines))
        if relative.suffix in SOURCE_SUFFIXES:
            sources += 1
            found += check_source(relative, lines, root)
        problems += [(relative.as_posix(), number, message) for number, message in sorted(found)]
    return problems, sources


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = pathlib.Path(sys.argv[1]).resolve()
    problems, sources = check(root)
    for name, number, message in problems:
        print(f"{name}:{number}: {message}")
    if sources == 0:
        sys.exit(f"{root}: no sources found: is this the root of the repository?")
    print(f"{sources} sources, {len(problems)} violations")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
