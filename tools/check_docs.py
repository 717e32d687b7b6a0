#!/usr/bin/env python3
"""Keeps the documents true.

  tools/check_docs.py [--write] [ROOT]

Prints one line per offence in README.md, the other *.md of the root, and docs/:

  - a link to a file, or to a heading, that is not there;
  - a block of code marked cpp, sh, json or python that is not a region of a file in examples/, where ctest runs it. The line
    before such a block names the region: <!-- examples/hello.cpp: touch -->. In the file the region stands between the
    lines "// region touch" and "// end touch" (in scripts "# region", "# end").

--write copies the regions into the blocks. Exit status: 0 clean, 1 offences, 2 wrong usage.
"""

import pathlib
import re
import sys
import textwrap

MARK = re.compile(r"^<!-- (examples/[\w./-]+)(?:: ([\w-]+))? -->$")
FENCE = re.compile(r"^(```+)\s*([\w-]*)\s*$")
LINK = re.compile(r"!?\[[^\]\n]*\]\(([^)\s]+)\)")
CHECKED = {"cpp", "sh", "json", "python"}


def region(path, name):
    """The lines of a region, or of the whole file without a name; None where there is none."""
    if not path.is_file():
        return None
    lines = path.read_text(encoding="utf-8").splitlines()
    if name is None:
        return lines
    edges = [at for at, line in enumerate(lines) if re.fullmatch(rf"\s*(//|#) (region|end) {re.escape(name)}", line)]
    if len(edges) != 2:
        return None
    return textwrap.dedent("\n".join(lines[edges[0] + 1:edges[1]])).splitlines()


def anchor(heading):
    """The name by which a heading is linked to."""
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", heading.strip().lower()))


def parse(text):
    """(prose, blocks) of a document: prose as (line number, text), blocks as (first line number, language, lines, mark)."""
    prose, blocks = [], []
    lines, at, before = text.splitlines(), 0, ""
    while at < len(lines):
        fence = FENCE.match(lines[at])
        if fence:
            end = at + 1
            while end < len(lines) and lines[end].rstrip() != fence.group(1):
                end += 1
            blocks.append((at + 1, fence.group(2), lines[at + 1:end], MARK.match(before)))
            at = end
        else:
            prose.append((at + 1, lines[at]))
            if lines[at].strip():
                before = lines[at].strip()
        at += 1
    return prose, blocks


def check_links(root, document, prose):
    """Offences of the links of one document."""
    for number, line in prose:
        for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            if re.match(r"^(https?|mailto):", target):
                continue
            name, _, heading = target.partition("#")
            path = (document.parent / name).resolve() if name else document
            where = f"{document.relative_to(root)}:{number}"
            if not path.exists() or root not in [path, *path.parents]:
                yield f"{where}: {target} is not there"
            elif heading and path.suffix == ".md":
                headings = [line.lstrip("#") for _, line in parse(path.read_text(encoding="utf-8"))[0] if line.startswith("#")]
                if heading not in map(anchor, headings):
                    yield f"{where}: {name or document.name} has no heading {heading}"


def check_blocks(root, document, blocks, write):
    """Offences of the code blocks of one document; with `write`, differing blocks are replaced instead."""
    text = document.read_text(encoding="utf-8").splitlines()
    for number, language, lines, mark in reversed(blocks):
        if language not in CHECKED:
            continue
        where = f"{document.relative_to(root)}:{number}"
        wanted = region(root / mark.group(1), mark.group(2)) if mark else None
        if mark is None:
            yield f"{where}: a {language} block must be a region of a file in examples/"
        elif wanted is None:
            yield f"{where}: {mark.group(1)} has no region {mark.group(2)}"
        elif wanted != lines and write:
            text[number:number + len(lines)] = wanted
        elif wanted != lines:
            yield f"{where}: differs from {mark.group(1)}; run tools/check_docs.py --write"
    if write:
        document.write_text("\n".join(text) + "\n", encoding="utf-8")


def check(root, write=False):
    """All offences of the tree, as lines of text in a fixed order."""
    root = root.resolve()
    offences = []
    for document in [*sorted(root.glob("*.md")), *sorted((root / "docs").rglob("*.md"))]:
        prose, blocks = parse(document.read_text(encoding="utf-8"))
        offences.extend(check_links(root, document, prose))
        offences.extend(check_blocks(root, document, blocks, write))
    return offences


def main(arguments):
    write = "--write" in arguments
    places = [word for word in arguments if word != "--write"]
    if len(places) > 1 or any(word.startswith("-") for word in places):
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(places[0]) if places else pathlib.Path(__file__).resolve().parent.parent
    offences = check(root, write)
    for offence in offences:
        print(offence)
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
