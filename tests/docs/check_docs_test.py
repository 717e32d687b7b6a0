"""The check of the documents must catch a dead link and a block of code that nobody runs."""

import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "tools"))
import check_docs  # noqa: E402

EXAMPLE = "int main() {\n  // region touch\n  if (true) {\n    touch();\n  }\n  // end touch\n}\n"
GOOD = "# Relief\n\n## Two words\n\n<!-- examples/a.cpp: touch -->\n```cpp\nif (true) {\n  touch();\n}\n```\n"


class CheckDocs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("examples/a.cpp", EXAMPLE)
        self.write("README.md", GOOD)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text, encoding="utf-8")

    def assert_one(self, words):
        offences = check_docs.check(self.root)
        self.assertEqual(len(offences), 1, offences)
        self.assertIn(words, offences[0])

    def test_good_document_passes(self):
        self.write("docs/a.md", "[b](../README.md#two-words) [c](https://example.org/x) `[no](link.md)`\n```text\n[no](link)\n```\n")
        self.assertEqual(check_docs.check(self.root), [])

    def test_dead_links_are_caught(self):
        for link in ("gone.md", "../README.md#gone", "#gone", "../../outside.md"):
            self.write("docs/a.md", f"[a]({link})\n")
            self.assert_one("docs/a.md:1")

    def test_code_that_nobody_runs_is_caught(self):
        self.write("docs/a.md", "text\n```cpp\nint x;\n```\n")
        self.assert_one("docs/a.md:2: a cpp block")

    def test_missing_region_is_caught(self):
        self.write("docs/a.md", "<!-- examples/a.cpp: carve -->\n```cpp\n```\n")
        self.assert_one("no region carve")

    def test_block_that_differs_is_caught_and_written(self):
        self.write("README.md", GOOD.replace("  touch();\n", "  carve();\n  carve();\n"))
        self.assert_one("README.md:6: differs")
        self.assertEqual(check_docs.check(self.root, write=True), [])
        self.assertEqual((self.root / "README.md").read_text(encoding="utf-8"), GOOD)


if __name__ == "__main__":
    unittest.main()
