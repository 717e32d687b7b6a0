"""The version stands in CMake, in `relief --version` and in CHANGELOG.md, which keeps to its own form.

RELIEF_BIN names the folder of the program, as for the tests of the command line.
"""

import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
HEADINGS = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security", "Format", "API"]
MOST_WORDS = 30  # of an entry: what is longer belongs to a page


def releases(text):
    """(version, date, number of the line) of each release, the newest first; Unreleased has neither version nor date."""
    found = re.finditer(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})$", text, re.M)
    return [(m[1], m[2], text.count("\n", 0, m.start()) + 1) for m in found]


def offences(text):
    """One sentence for each place of a changelog that breaks its form."""
    said = []
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        if line.startswith("## ") and line != "## [Unreleased]" and not releases(line):
            said.append(f"{number}: a release is ## [X.Y.Z] - YYYY-MM-DD: {line}")
        if line.startswith("### ") and line[4:] not in HEADINGS:
            said.append(f"{number}: {line[4:]} is none of {', '.join(HEADINGS)}")
        if line.startswith("- "):
            words = len(re.sub(r"\]\([^)]*\)", "]", line[2:]).split())
            if words > MOST_WORDS:
                said.append(f"{number}: {words} words, at most {MOST_WORDS}: {line}")
            if line.count("](") > 1:
                said.append(f"{number}: more than one link: {line}")
        if line.startswith("  ") and line.strip():
            said.append(f"{number}: an entry is one line: {line}")
    dates = [date for _, date, _ in releases(text)]
    if dates != sorted(dates, reverse=True):
        said.append("the newest release comes first")
    return said


class Changelog(unittest.TestCase):
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")

    def test_version_is_the_same_everywhere(self):
        cmake = re.search(r"^project\(Relief VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.M)[1]
        program = pathlib.Path(os.environ["RELIEF_BIN"]) / "relief"
        shown = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(shown.split()[:2], ["relief", cmake])
        self.assertEqual(releases(self.text)[0][0], cmake)

    def test_changelog_keeps_its_form(self):
        self.assertEqual(offences(self.text), [])

    def test_what_breaks_the_form_is_caught(self):
        good = "## [Unreleased]\n\n## [0.2.0] - 2026-02-01\n\n### Added\n\n- A [page](a.md).\n\n## [0.1.0] - 2026-01-01\n"
        self.assertEqual(offences(good), [])
        for line in ("## 0.0.1", "### Improved", "- " + "word " * (MOST_WORDS + 1), "- [a](a.md) [b](b.md)", "  more", "## [0.1.1] - 2026-03-01"):
            self.assertEqual(len(offences(good + line + "\n")), 1, line)


if __name__ == "__main__":
    unittest.main()
