#!/usr/bin/env python3
"""Keeps the documents true.

  tools/check_docs.py [--write] [ROOT]

Prints one line per offence in README.md, the other *.md of the root, and docs/:

  - a link to a file, or to a heading, that is not there;
  - a block of code marked cpp, cmake, sh, json or python that is not a region of a file in examples/, where ctest runs it. The line
    before such a block names the region: <!-- examples/hello.cpp: touch -->. In the file the region stands between the
    lines "// region touch" and "// end touch" (in scripts "# region", "# end");
  - prose that breaks a limit of tools/prose.py, or a page that is longer than docs/pages.tsv allows, or is not listed there;
  - a page of docs/ that mkdocs.yml does not lead to, or one there that is not in docs/;
  - a word that neither the British dictionary of hunspell nor docs/words.txt knows (where hunspell is installed).

--write copies the regions into the blocks, and sorts docs/words.txt. Exit status: 0 clean, 1 offences, 2 wrong usage.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import textwrap

import prose

MARK = re.compile(r"^<!-- (examples/[\w./-]+)(?:: ([\w-]+))? -->$")
FENCE = re.compile(r"^(```+)\s*([\w-]*)\s*$")
LINK = re.compile(r"!?\[[^\]\n]*\]\(([^)\s]+)\)")
CHECKED = {"cpp", "cmake", "sh", "json", "python"}


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
    """(text, blocks) of a document: its text as (line number, text), blocks as (first line number, language, lines, mark)."""
    text_lines, blocks = [], []
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
            text_lines.append((at + 1, lines[at]))
            if lines[at].strip():
                before = lines[at].strip()
        at += 1
    return text_lines, blocks


def check_links(root, document, lines):
    """Offences of the links of one document."""
    for number, line in lines:
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


def page_limits(root):
    """The rows of docs/pages.tsv: (glob, most words, least pictures)."""
    rows = [line.split("\t") for line in (root / "docs/pages.tsv").read_text(encoding="utf-8").splitlines()]
    return [(row[0], int(row[1]), int(row[2])) for row in rows if len(row) == 3 and not row[0].startswith("#")]


def check_prose(root, document, limits):
    """Offences of how one document reads, and of its length."""
    name = document.relative_to(root)
    mine = [(most, pictures) for glob, most, pictures in limits if name.match(glob)]
    if not mine:
        yield f"{name}:1: no row of docs/pages.tsv allows this page"
        return
    history = name.name == "CHANGELOG.md" or "decisions" in name.parts
    for number, offence in prose.offences(document.read_text(encoding="utf-8"), history, *mine[-1]):
        yield f"{name}:{number}: {offence}"


def check_navigation(root, documents):
    """Each page of docs/ is once in the navigation of the site, which has no others."""
    listed = re.findall(r"[\w./-]+\.md", (root / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2])
    pages = {str(d.relative_to(root / "docs")) for d in documents if (root / "docs") in d.parents}
    for page in sorted(pages - set(listed)):
        yield f"docs/{page}:1: mkdocs.yml does not lead to it"
    for page in sorted(p for p in set(listed) if p not in pages or listed.count(p) > 1):
        yield f"mkdocs.yml:1: {page} is not in docs/, or stands there twice"


def check_spelling(root, documents, write):
    """Words that no dictionary knows. Code, links and names in capitals are left out by hunspell or below."""
    own = root / "docs/words.txt"
    known = own.read_text(encoding="utf-8").split()
    if write:
        own.write_text("\n".join(sorted(set(known), key=lambda w: (w.lower(), w))) + "\n", encoding="utf-8")
    elif known != sorted(set(known), key=lambda w: (w.lower(), w)):
        yield "docs/words.txt:1: is not sorted; run tools/check_docs.py --write"
    if not shutil.which("hunspell"):
        return
    places = {}
    for document in documents:
        page = prose.read(document.read_text(encoding="utf-8"))
        for number, body in page.paragraphs + page.cells:
            seen = re.sub(r"`code`|https?://\S+|[\w./-]+\.\w+", " ", prose.shown(body))
            for word in re.findall(r"[^\W\d_][\w'-]*", seen):
                if not re.search(r"\d|_|[a-z][A-Z]", word):
                    places.setdefault(word, f"{document.relative_to(root)}:{number}")
    told = subprocess.run(["hunspell", "-i", "utf-8", "-d", "en_GB", "-l"], input="\n".join(places), capture_output=True, text=True,
                          check=True, env={"LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"})
    unknown = set(told.stdout.split()) - set(known)
    for word, place in places.items():
        if word in unknown:
            yield f"{place}: \"{word}\" is in no dictionary; docs/words.txt has our own words"


def check(root, write=False):
    """All offences of the tree, as lines of text in a fixed order."""
    root = root.resolve()
    offences, limits = [], page_limits(root)
    documents = [*sorted(root.glob("*.md")), *sorted((root / "docs").rglob("*.md"))]
    for document in documents:
        text, blocks = parse(document.read_text(encoding="utf-8"))
        offences.extend(check_links(root, document, text))
        offences.extend(check_blocks(root, document, blocks, write))
        offences.extend(check_prose(root, document, limits))
    offences.extend(check_navigation(root, documents))
    offences.extend(check_spelling(root, documents, write))
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
