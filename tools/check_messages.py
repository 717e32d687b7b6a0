#!/usr/bin/env python3
"""Checks that the messages on docs/reference/messages.md are those of the program, and that algorithms of relief/convert hold none.

  tools/check_messages.py [ROOT]

The first cell of each row quotes a message; `...` stands for names and numbers. Each piece between them must stand in a text of
the source, where neighbouring literals are one. In relief/convert only the files of its words hold sentences. Exit status: 0 clean, 1 offences, 2 wrong usage.
"""

import pathlib
import re
import sys

PAGE = pathlib.Path("docs/reference/messages.md")
LITERALS = re.compile(r'"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*')
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
ENGINE = pathlib.Path("relief/convert")
ENGINE_WORDS = {"failures.cpp", "obstacle_text.cpp", "report.cpp", "support/words.h"}
WORDS = re.compile(r"[a-z]{2,}:? [a-z]{2,}")
LEAST = 4  # characters of a piece: shorter ones stand everywhere


def texts_of(source):
    """The literals of C++ text, neighbours joined, escapes of quotes resolved."""
    for run in LITERALS.finditer(re.sub(r"^\s*(//.*|#include.*)$", "", source, flags=re.M)):
        yield "".join(LITERAL.findall(run.group())).replace('\\"', '"')


def quoted(page):
    """(line number, message) of each row of a table of messages."""
    for number, line in enumerate(page.splitlines(), 1):
        message = re.match(r"\| `([^`]+)` \|", line)
        if message:
            yield number, message.group(1)


def pieces(message):
    return [piece.strip(" :;,.") for piece in message.split("...") if len(piece.strip(" :;,.")) >= LEAST]


def check(root):
    files = [file for folder in ("apps", "relief") for kind in ("*.cpp", "*.h") for file in (root / folder).rglob(kind)]
    known = "\0".join(text for file in sorted(files) for text in texts_of(file.read_text(encoding="utf-8")))
    for number, message in quoted((root / PAGE).read_text(encoding="utf-8")):
        wanted = pieces(message)
        if not wanted:
            yield f"{PAGE}:{number}: \"{message}\" is too short to be looked for"
        for piece in wanted:
            if piece not in known:
                yield f"{PAGE}:{number}: no text of the program has \"{piece}\""


def check_engine(root):
    for file in sorted([*(root / ENGINE).rglob("*.cpp"), *(root / ENGINE).rglob("*.h")]):
        if file.relative_to(root / ENGINE).as_posix() in ENGINE_WORDS:
            continue
        source = re.sub(r"static_assert\(.*?;", "", file.read_text(encoding="utf-8"), flags=re.S)
        for text in texts_of(source):
            if WORDS.search(text):
                yield f"{file.relative_to(root)}: \"{text}\" is a sentence of an algorithm; it belongs to {ENGINE / 'failures.cpp'}"


def main(arguments):
    if len(arguments) > 1 or any(word.startswith("-") for word in arguments):
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parent.parent
    found = [*check(root), *check_engine(root)]
    print("\n".join(found) if found else "the messages are those of the program")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
