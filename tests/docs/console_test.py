#!/usr/bin/env python3
"""Runs the commands of the pages and compares what they print with what the pages show.

  tests/docs/console_test.py [--write] BIN [PAGE...]

BIN is the folder of the built programs, for example build/release/bin; it comes first on PATH. Without a PAGE: README.md and every
page of docs/tutorials and docs/how-to.

A block marked console holds commands, "$ command", each with its output below it. A command goes on in the lines that start
with "> ", and after a "\\" at its end. All blocks of a page run in order, in one shell, in one empty folder. Standard error is
part of the output. These may differ:

  - numbers, by 2 %; those before s, ms, us, min, h, CPU and MiB, and before "times real time", by anything;
  - the number of spaces;
  - any lines, where the page has a line "...".

A command must succeed if the page shows no line of its output. In a page:

  <!-- files: examples/press.csv -->    copies files of the tree into the folder, before the first command
  <!-- not run: it opens a window -->   on the line before a block: it is not run, and why

--write puts what was printed into the pages where it differs. Exit status: 0 all is as shown, 1 something is not, 2 wrong usage.
"""

import difflib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import check_docs  # noqa: E402

FILES = re.compile(r"^<!-- files: (.+) -->$", re.MULTILINE)
NOT_RUN = re.compile(r"^<!-- not run: \S.* -->$")
NUMBER = re.compile(r"(?<![\w.])(\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?)(\s*(?:(?:s|ms|us|µs|min|h|CPU|MiB)\b|times real time))?")
TOLERANCE = 0.02  # of a number: compilers and processors round differently
LIMIT = 540       # s for one page, ten times what it takes on a machine that is not busy
MARK = "\x1e"     # ends the output of a command; no page shows it


class Command:
    """One command of a page: the line of its "$" counted from 0, its text, and the lines that the page shows below it."""

    def __init__(self, line, text):
        self.line = line
        self.text = text
        self.lines = 1  # of the page that hold the command itself
        self.shown = []
        self.printed = []
        self.status = None

    def as_shown(self):
        """Whether the command printed what the page shows."""
        told = [line for line in self.shown if line.strip() != "..."]
        return matches(self.shown, self.printed) and (bool(told) or self.status == 0)


def commands_of(text):
    """The commands of a page that are to be run, in order."""
    lines, found = text.splitlines(), []
    for first, language, block, _ in check_docs.parse(text)[1]:
        before = next((line.strip() for line in reversed(lines[:first - 1]) if line.strip()), "")
        if language != "console" or NOT_RUN.match(before):
            continue
        command = None
        for number, line in enumerate(block, first):
            if line.startswith("$ "):
                command = Command(number, line[2:])
                found.append(command)
            elif command is None:
                raise ValueError(f"line {number + 1}: a console block starts with \"$ command\"")
            elif not command.shown and (line.startswith("> ") or command.text.endswith("\\")):
                command.text += "\n" + line.removeprefix("> ")
                command.lines += 1
            else:
                command.shown.append(line)
    for command in found:
        trim(command.shown)
    return found


def trim(lines):
    """Drops blank lines at the end."""
    while lines and not lines[-1].strip():
        lines.pop()


def same(shown, printed):
    """Whether two lines differ in nothing but spaces, measured times and the last digits of numbers."""
    if [" ".join(text.split()) for text in NUMBER.sub("#", shown).split("#")] != \
            [" ".join(text.split()) for text in NUMBER.sub("#", printed).split("#")]:
        return False
    pairs = list(zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True))
    values = [(float(a.replace(",", "")), float(b.replace(",", ""))) for (a, unit), (b, _) in pairs if not unit]
    return all(a[1].split() == b[1].split() for a, b in pairs) and \
        all(abs(a - b) <= TOLERANCE * max(a, b) for a, b in values)


def matches(shown, printed):
    """Whether the lines that were printed are those that the page shows; "..." stands for any lines."""
    if not shown:
        return not printed
    if shown[0].strip() == "...":
        return any(matches(shown[1:], printed[skipped:]) for skipped in range(len(printed) + 1))
    return bool(printed) and same(shown[0], printed[0]) and matches(shown[1:], printed[1:])


def run(commands, programs, files):
    """Runs commands in one shell in an empty folder that holds copies of `files`; fills in what they print and their status."""
    with tempfile.TemporaryDirectory(prefix="relief-page-") as place:
        folder, home = pathlib.Path(place, "work"), pathlib.Path(place, "home")
        folder.mkdir()
        home.mkdir()
        for file in files:
            shutil.copy(file, folder)
        script = "".join(f"{command.text}\nstatus=$?; printf '\\036%d\\n' $status; (exit $status)\n" for command in commands)
        pathlib.Path(place, "script").write_text(script, encoding="utf-8")
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "RELIEF_"))}
        environment |= {"PATH": f"{programs}:{os.environ['PATH']}", "HOME": str(home), "LC_ALL": "C.UTF-8"}
        output = subprocess.run(["bash", "../script"], cwd=folder, env=environment, timeout=LIMIT, check=False,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout
    for command in commands:
        printed, _, rest = output.partition(MARK.encode())
        status, _, output = rest.partition(b"\n")
        command.printed = printed.decode("utf-8", "replace").splitlines()
        trim(command.printed)
        command.status = int(status) if status else None


def written(text, commands):
    """The page with what was printed in the place of what it shows, where that differs."""
    lines = text.splitlines()
    for command in reversed(commands):
        if not command.as_shown():
            first = command.line + command.lines
            lines[first:first + len(command.shown)] = command.printed
    return "\n".join(lines) + "\n"


def check(page, programs, root=ROOT, write=False):
    """The offences of one page, as text."""
    text = page.read_text(encoding="utf-8")
    name = page.relative_to(root) if page.is_relative_to(root) else page
    files = [root / file for match in FILES.findall(text) for file in match.split()]
    missing = [file for file in files if not file.is_file()]
    if missing:
        return [f"{name}: {missing[0]} is not there"]
    try:
        commands = commands_of(text)
    except ValueError as error:
        return [f"{name}: {error}"]
    if not commands:
        return []
    try:
        run(commands, programs, files)
    except subprocess.TimeoutExpired:
        return [f"{name}: took more than {LIMIT} s"]
    if write:
        page.write_text(written(text, commands), encoding="utf-8")
    offences = []
    for command in commands:
        if not command.as_shown():
            differences = list(difflib.unified_diff(command.shown, command.printed, "shown", "printed", lineterm="", n=1))
            offences.append("\n".join([f"{name}:{command.line + 1}: $ {command.text} (exit status {command.status})", *differences]))
    return offences


def main(arguments):
    write = "--write" in arguments
    words = [word for word in arguments if word != "--write"]
    if not words or any(word.startswith("-") for word in words) or not pathlib.Path(words[0]).is_dir():
        print(__doc__, file=sys.stderr)
        return 2
    every = [ROOT / "README.md", *sorted(ROOT.glob("docs/tutorials/*.md")), *sorted(ROOT.glob("docs/how-to/*.md"))]
    pages = [pathlib.Path(word).resolve() for word in words[1:]] or every
    offences = [offence for page in pages for offence in check(page, pathlib.Path(words[0]).resolve(), write=write)]
    for offence in offences:
        print(offence)
    return 1 if offences and not write else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
