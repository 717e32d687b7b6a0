"""The checkers of the reference must themselves catch what they are for."""

import json
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))

import check_messages  # noqa: E402
import command_reference  # noqa: E402

OPTION = {"names": ["-n", "--number"], "placeholder": "N", "meaning": "how many", "choices": [], "range": "1 to 9", "default": "4",
          "required": False, "needs": ["--all"], "excludes": [], "section": None}
GENERAL = {**OPTION, "names": ["--json"], "placeholder": None, "section": "General"}
COUNT = {"command": "count", "positionals": [], "options": [OPTION, GENERAL]}
PAGE = "# relief count\n\n<!-- options: count -->\n<!-- end -->\n"


class CommandReference(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        root = pathlib.Path(self.folder.name)
        pages = root / "command-line"
        pages.mkdir()
        (root / "command-line.md").write_text("[count](command-line/count.md) `--json`\n")
        (pages / "count.md").write_text(PAGE)
        self.page, self.commands = pages / "count.md", [COUNT]
        self.program = root / "relief"
        self.index = root / "command-line.md"
        saved = (command_reference.ROOT, command_reference.PAGES, command_reference.INDEX)
        self.addCleanup(self.restore, saved)
        self.restore((root, pages, self.index))

    @staticmethod
    def restore(places):
        command_reference.ROOT, command_reference.PAGES, command_reference.INDEX = places

    def offences(self, write=False):
        self.program.write_text(f"#!/bin/sh\ncat <<'END'\n{json.dumps({'commands': self.commands})}\nEND\n")
        self.program.chmod(0o755)
        return list(command_reference.offences(str(self.program), write))

    def test_writes_options_and_then_finds_nothing(self):
        self.assertEqual(1, len(self.offences()))
        self.offences(write=True)
        self.assertEqual([], self.offences())
        text = self.page.read_text()
        self.assertIn("| `-n, --number N` | 4 | how many; 1 to 9; needs `--all` |", text)
        self.assertNotIn("--json", text)

    def test_choices_are_told_in_words(self):
        self.commands = [{**COUNT, "options": [{**OPTION, "placeholder": "a|b", "choices": ["a", "b"]}, GENERAL]}]
        self.offences(write=True)
        self.assertIn("| `-n, --number NUMBER` | 4 | how many; 1 to 9: `a`, `b`; needs `--all` |", self.page.read_text())

    def test_large_numbers(self):
        self.assertEqual("1,000 to 1e9", command_reference.readable("1000 to 1000000000"))
        self.assertEqual("1e-7 to 0.0001", command_reference.readable("1e-7 to 0.0001"))

    def test_an_option_that_changed(self):
        self.offences(write=True)
        self.commands = [{**COUNT, "options": [{**OPTION, "default": "5"}, GENERAL]}]
        self.assertIn("not those of the program", self.offences()[0])

    def test_a_command_without_a_page_and_a_page_without_a_command(self):
        self.offences(write=True)
        self.commands = [COUNT, {**COUNT, "command": "sum"}]
        self.assertIn("the command sum has no page", self.offences()[0])
        self.commands = []
        self.assertIn("relief has no command count", self.offences()[0])

    def test_a_common_option_that_the_index_does_not_name(self):
        self.offences(write=True)
        self.index.write_text("[count](command-line/count.md)\n")
        self.assertIn("does not name --json", self.offences()[0])


class Messages(unittest.TestCase):
    def check(self, source, message):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "apps").mkdir()
            (root / "docs" / "reference").mkdir(parents=True)
            (root / "apps" / "a.cpp").write_text(source)
            (root / check_messages.PAGE).write_text(f"| `{message}` | cause | remedy |\n")
            return list(check_messages.check(root))

    def test_a_message_of_joined_literals(self):
        self.assertEqual([], self.check('fail("{}: no such "\n     "file")', "...: no such file"))

    def test_a_message_that_changed(self):
        self.assertEqual(1, len(self.check('fail("{}: there is no file")', "...: no such file")))

    def test_a_sentence_of_an_algorithm(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / check_messages.ENGINE / "support").mkdir(parents=True)
            for name in (*check_messages.ENGINE_WORDS, "room.cpp"):
                (root / check_messages.ENGINE / name).write_text('static_assert(a, "kept in bytes");\nfail("no such room");\n')
            offences = list(check_messages.check_engine(root))
            self.assertEqual(1, len(offences))
            self.assertIn("room.cpp: \"no such room\"", offences[0])

    def test_a_comment_is_no_message(self):
        self.assertEqual(1, len(self.check('// "no such file"\n', "no such file")))


if __name__ == "__main__":
    unittest.main()
