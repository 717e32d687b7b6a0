"""The runner of the pages' commands must catch a page that shows something else than the programs print."""

import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import console_test  # noqa: E402


class Console(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "bin").mkdir()

    def check(self, block, before="", write=False):
        self.page = self.root / "page.md"
        self.page.write_text(f"# Page\n\n{before}\n```console\n{block}\n```\n", encoding="utf-8")
        return console_test.check(self.page, self.root / "bin", self.root, write)

    def assert_as_shown(self, block, before=""):
        self.assertEqual(self.check(block, before), [])

    def assert_differs(self, block, words="page.md:5: $ "):
        offences = self.check(block)
        self.assertEqual(len(offences), 1, offences)
        self.assertIn(words, offences[0])

    def test_output_as_shown_passes(self):
        self.assert_as_shown("$ echo one; echo two >&2\none\ntwo\n$ true")

    def test_other_output_is_caught(self):
        self.assert_differs("$ echo two\none", "+two")
        self.assert_differs("$ echo one; echo two\none")
        self.assert_differs("$ echo one\none\ntwo")
        self.assert_differs("$ echo one")
        self.assert_differs("$ true\none")

    def test_numbers_may_differ_by_two_percent(self):
        self.assert_as_shown("$ echo 'depth 0.990 mm of 1,010 and 1.01e-05'\ndepth 1.000 mm of 1,000 and 1e-05")
        self.assert_differs("$ echo depth 0.97\ndepth 1.00")
        self.assert_differs("$ echo 41 slabs\n40 slabs")
        self.assert_differs("$ echo -- -1.0\n-- 1.0")
        self.assert_differs("$ echo P3\nP4")

    def test_times_and_memory_may_differ(self):
        self.assert_as_shown("$ echo '12.5 s, 3 CPU s,   7 MiB, 9 ms'\n1.5 s, 1 CPU s, 250 MiB, 80 ms")
        self.assert_differs("$ echo 12.5 samples\n1.5 samples")
        self.assert_differs("$ echo 12.5 ms\n12.5 s")

    def test_dots_stand_for_any_lines(self):
        self.assert_as_shown("$ seq 5\n1\n...\n4\n5")
        self.assert_as_shown("$ echo 1\n1\n...")
        self.assert_differs("$ seq 5\n1\n...\n4")

    def test_a_failure_is_shown_or_caught(self):
        self.assert_as_shown("$ echo no; false\nno\n$ echo $?\n1")
        self.assert_differs("$ false", "exit status 1")
        self.assert_differs("$ echo no; false\n...", "exit status 1")

    def test_commands_share_a_shell_and_a_folder(self):
        self.assert_as_shown("$ mkdir a && cd a\n$ echo x > b\n```\n\n```console\n$ cat b\nx\n$ basename $PWD\na")

    def test_commands_of_several_lines(self):
        self.assert_as_shown("$ echo one \\\n    two\none two\n$ cat <<END\n> three\n> END\nthree")

    def test_marks_of_a_page(self):
        self.assert_as_shown("$ false\nnever", "<!-- not run: it would fail -->")
        (self.root / "data").mkdir()
        (self.root / "data" / "a.txt").write_text("here\n", encoding="utf-8")
        self.assert_as_shown("$ cat a.txt\nhere", "<!-- files: data/a.txt -->\n")
        self.assertIn("is not there", self.check("$ true", "<!-- files: data/b.txt -->\n")[0])

    def test_a_block_must_start_with_a_command(self):
        self.assertIn("line 5", self.check("out\n$ true")[0])

    def test_write_makes_a_page_pass(self):
        self.check("$ echo 3.01\n3\n$ echo \\\n  two\n\n$ echo four\nfive\nsix", write=True)
        text = self.page.read_text(encoding="utf-8")
        self.assertIn("$ echo 3.01\n3\n$ echo \\\n  two\ntwo\n", text)
        self.assertIn("$ echo four\nfour\n```\n", text)
        self.assertEqual(console_test.check(self.page, self.root / "bin", self.root), [])


if __name__ == "__main__":
    unittest.main()
