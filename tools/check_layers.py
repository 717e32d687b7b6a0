#!/usr/bin/env python3
"""Checks that the parts of Relief depend on each other only as they may.

  tools/check_layers.py [ROOT]

Reads the includes of every source file and the link lines of every part, and prints one line per offence:

  - an arrow between parts that ARROWS does not have, directly or through what lies below;
  - a circle of includes between files;
  - an internal header, which is one that cmake/public-headers.txt does not list, used outside its own part and that
    part's tests and benchmarks (those of base are for every source file of the project);
  - a header of another library in a public header, or in a part whose THIRD_PARTY does not name it;
  - a public header that is listed and not there, or the list out of order;
  - a part in the wrong place: every source file lies in relief/<part>/ or a folder of that.

Exit status: 0 clean, 1 offences, 2 wrong usage.
"""

import pathlib
import re
import sys

# Each part, and what it may include besides itself; what lies below those is allowed as well.
ARROWS = {
    "base": [],
    "mesh": ["base"],
    "core": ["base"],
    "verify": ["base"],
    "convert": ["core", "mesh", "verify"],
    "edit": ["core", "verify"],
    "haptics": ["core"],
    "file": ["core", "verify"],
    "render": ["core"],
    "devices": ["haptics"],
    "session": ["haptics", "edit", "file"],
}

# Why some of the missing arrows are missing, for the person who meets them.
REASONS = {
    ("core", "mesh"): "the servo links no importer",
    ("core", "verify"): "the verifier judges what others made",
    ("core", "haptics"): "a model does not know who touches it",
    ("verify", "core"): "the verifier works on plain spans and trusts nobody's types",
    ("verify", "convert"): "the verifier shares no code with what it judges",
    ("haptics", "edit"): "touch does not know sculpting",
    ("haptics", "render"): "no OpenGL near the servo",
    ("edit", "haptics"): "a dab has no device",
    ("session", "render"): "no OpenGL near the servo; the caller draws",
    ("render", "session"): "a picture needs a snapshot and nothing that moves",
    ("session", "devices"): "the caller brings the device",
    ("file", "edit"): "the file keeps rows and tiles; it does not know what a dab means",
}

# Libraries besides the standard one, by the start of the header's name, and the parts whose sources may include them.
THIRD_PARTY = {
    "Eigen/": ["convert"],
    "tbb/": ["convert"],
    "oneapi/": ["convert"],
    "embree3/": ["convert"],
    "meshoptimizer.h": ["mesh"],
    "draco/": ["mesh"],
    "zlib.h": ["mesh", "file"],
    "nlohmann/": ["mesh", "devices", "session"],
    "sqlite3.h": ["file"],
    "zstd": ["file"],
    "epoxy/": ["render"],
    "EGL/": ["render"],
    "fontconfig/": ["render"],
    "ft2build.h": ["render"],
    "png.h": ["render", "mesh"],
    "jpeglib.h": ["mesh"],
}

# The public headers, one path per line; these are installed.
PUBLIC_LIST = "cmake/public-headers.txt"
# The part whose internal headers every source file of the project may include.
COMMON = "base"

# Headers of the operating system and the compiler: any source file, no public header.
SYSTEM = re.compile(
    r"^(sys/\w+|linux/\w+|unistd|fcntl|pthread|sched|signal|poll|dlfcn|dirent|time|errno|alloca|malloc|\w*intrin)\.h$"
)
STANDARD = re.compile(r"^[a-z][a-z_0-9]*$")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:<([^>\n]+)>|"([^"\n]+)")', re.MULTILINE)
COMMENT_OR_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"', re.DOTALL)
SUFFIXES = {".h", ".cpp"}


def closure(part):
    """The part and everything below it."""
    seen, todo = set(), [part]
    while todo:
        at = todo.pop()
        if at not in seen:
            seen.add(at)
            todo.extend(ARROWS[at])
    return seen


def part_of(path):
    """The part that a path below the root belongs to, or None."""
    if path.parts[0] == "relief" and len(path.parts) > 2:
        return path.parts[1]
    return None


def tested_part(path):
    """tests/unit/<part>... and bench/<part>/ may look inside that part, the tests of touch inside haptics."""
    if path.parts[0] == "bench" and len(path.parts) > 2:
        return path.parts[1]
    if path.parts[0] == "tests" and path.parts[1] in ("acceptance", "support"):
        return "haptics"
    if path.parts[0] == "tests" and len(path.parts) > 3:
        return path.parts[2].split("_")[0]
    return None


def includes(root, path):
    """(line, name or path below the root, whether it is one of ours) for each include of a file."""
    text = (root / path).read_text(encoding="utf-8", errors="replace")
    text = COMMENT_OR_TEXT.sub(lambda match: "\n" * match.group(0).count("\n"), text)
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        name = match.group(1) or match.group(2)
        if name.startswith("relief/"):
            yield line, pathlib.Path(name), True
        elif match.group(2) and (root / path.parent / name).exists():
            yield line, (root / path.parent / name).resolve().relative_to(root), True
        else:
            yield line, name, False


def circles(graph):
    """One list of files per circle, by depth-first search in a fixed order."""
    state, found = {}, []

    def visit(node, trail):
        state[node] = "open"
        trail.append(node)
        for target in sorted(graph.get(node, ())):
            if state.get(target) == "open":
                found.append(trail[trail.index(target):] + [target])
            elif target not in state:
                visit(target, trail)
        trail.pop()
        state[node] = "done"

    for node in sorted(graph):
        if node not in state:
            visit(node, [])
    return found


def arrow_offence(source, target):
    """What is wrong with `source` depending on `target`, or None."""
    if target not in ARROWS:
        return f"there is no part {target}"
    if target in closure(source):
        return None
    reason = REASONS.get((source, target))
    return f"{source} may not depend on {target}" + (f": {reason}" if reason else "")


def check_include(path, target, known, public):
    """Offences of one include of one of our own headers. `known`: all files, `public`: the public headers."""
    source_part, target_part = part_of(path), part_of(target)
    if target_part is None:
        if source_part is not None:
            yield f"{source_part} may not include {target}, which is outside relief/"
        return
    if target not in known:
        yield f"there is no {target}"
        return
    if source_part is not None:
        offence = arrow_offence(source_part, target_part)
        if offence:
            yield offence
    if target in public:
        return
    if path in public:
        yield f"a public header includes {target}, which is not public"
    elif target_part not in (COMMON, source_part, tested_part(path)):
        yield f"{target} is internal to {target_part}"


def check_library(path, name, public):
    """Offences of one include of a header that is not ours, from a file of a part."""
    if STANDARD.match(name):
        return
    part = part_of(path)
    if path in public:
        yield f"public headers include nothing but relief/ and the standard library, not {name}"
    elif not SYSTEM.match(name):
        owners = [parts for start, parts in THIRD_PARTY.items() if name.startswith(start)]
        if not owners:
            yield f"{name} is of a library that tools/check_layers.py does not know"
        elif part not in owners[0]:
            yield f"{name} belongs to {', '.join(owners[0])}, not to {part}"


def check_links(root):
    """Offences in the link lines: a part links only what it may include."""
    for path in sorted(root.glob("relief/*/CMakeLists.txt")):
        part = path.parent.name
        text = re.sub(r"#[^\n]*", "", path.read_text(encoding="utf-8"))
        for target in re.findall(r"\brelief::(\w+)", text):
            offence = arrow_offence(part, target) if part in ARROWS else None
            if offence:
                yield f"{path.relative_to(root)}: {offence}"


def check(root):
    """All offences of the tree, as lines of text in a fixed order."""
    root = root.resolve()
    offences, graph = [], {}
    files = [
        path.relative_to(root)
        for folder in ("relief", "apps", "tests", "bench", "examples")
        for path in sorted((root / folder).rglob("*"))
        if path.suffix in SUFFIXES and path.is_file()
    ]
    known = set(files)
    listed = (root / PUBLIC_LIST).read_text(encoding="utf-8").split()
    public = {pathlib.Path(name) for name in listed}
    offences.extend(f"{PUBLIC_LIST}: there is no {name}" for name in sorted(map(str, public - known)))
    if listed != sorted(set(listed)):
        offences.append(f"{PUBLIC_LIST}: the names are not in order, each once")
    for path in files:
        part = part_of(path)
        if path.parts[0] == "relief":
            if part is None or part not in ARROWS:
                offences.append(f"{path}: no part of that name in tools/check_layers.py")
                continue
            if len(path.parts) > 4:
                offences.append(f"{path}: the folders of a part have no folders")
        graph[path] = set()
        for line, target, ours in includes(root, path):
            if ours:
                graph[path].add(target)
                found = check_include(path, target, known, public)
            else:
                found = check_library(path, target, public) if part is not None else ()
            offences.extend(f"{path}:{line}: {what}" for what in found)
    offences.extend("circle: " + " -> ".join(map(str, circle)) for circle in circles(graph))
    offences.extend(check_links(root))
    return offences


def main(arguments):
    if len(arguments) > 1 or any(word.startswith("-") for word in arguments):
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parent.parent
    offences = check(root)
    for offence in offences:
        print(offence)
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
