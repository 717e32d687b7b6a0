"""The check of the documents must catch a dead link, a block of code that nobody runs, and prose that nobody wants to read."""

import pathlib
import shutil
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
        self.write("docs/pages.tsv", "*.md\t60\t0\ndocs/a.md\t60\t0\n")
        self.write("docs/words.txt", "Relief\n")
        self.write("mkdocs.yml", "site_name: Relief\nnav:\n  - A: a.md\n")
        self.write("docs/a.md", "A page.\n")

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

    def test_prose_that_breaks_a_limit_is_caught(self):
        many = " ".join(["word"] * 36) + "."
        for text, words in ((many, "a sentence of 36 words"), ("It is made anew.", '"anew"; write'), ("It used to be so.", "changelog"),
                            ("One, two, three, four, five, six, seven.", "6 commas"), ("```\nx\n```", "without a language"),
                            ("| a |\n|---|\n| " + "word " * 26 + "|", "a cell of 26 words"), ("![a b](a.md)", "alternative text"),
                            ("A short one. " * 31, "93 words"), ("The page is read. " * 11, "100 % of the sentences are passive")):
            self.write("docs/a.md", text + "\n")
            offences = check_docs.check(self.root)
            self.assertTrue(any("docs/a.md" in o and words in o for o in offences), (words, offences))

    def test_what_is_generated_is_not_counted(self):
        self.write("docs/a.md", "A page.\n\n<!-- table: x -->\n\n| a |\n|---|\n| " + "word " * 80 + "|\n\n<!-- end -->\n\nIts end.\n")
        self.assertEqual(check_docs.check(self.root), [])

    def test_a_page_that_is_too_long_or_not_listed_is_caught(self):
        self.write("docs/a.md", "A short line.\n\n" * 21)
        self.assert_one("63 words; at most 60")
        self.write("docs/a.md", "A page.\n")
        self.write("docs/deep/b.md", "A page.\n")
        self.assert_one("mkdocs.yml does not lead to it")
        self.write("mkdocs.yml", "site_name: Relief\nnav:\n  - A: a.md\n  - B: deep/b.md\n  - C: c.md\n")
        self.assert_one("c.md is not in docs/")
        self.write("mkdocs.yml", "site_name: Relief\nnav:\n  - A: a.md\n  - B: deep/b.md\n")
        self.write("docs/pages.tsv", "README.md\t60\t0\ndocs/a.md\t60\t0\n")
        self.assert_one("no row of docs/pages.tsv")

    @unittest.skipUnless(shutil.which("hunspell"), "hunspell is not installed")
    def test_a_word_of_no_dictionary_is_caught(self):
        self.write("docs/a.md", "A pagge of Relief and `codde`.\n")
        self.assert_one('"pagge" is in no dictionary')
        self.write("docs/words.txt", "Relief\npagge\n")
        self.assert_one("is not sorted")
        self.assertEqual(check_docs.check(self.root, write=True), [])


if __name__ == "__main__":
    unittest.main()
