"""The tables of docs/evidence/ are those of bench/results/, and a table that is not is caught."""

import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import result_tables  # noqa: E402

PAGE = "# Page\n\n<!-- table: queries -->\n<!-- end -->\n"


def result(**changed):
    row = {"query": "locate", "on": "a model", "unit": "ns", "clock": "thread CPU", "p50": 51, "p90": 60.25, "p99": 1234.5, "max": 9000}
    return {"bench": "query", "machine": "m", "cpu": "a processor", "cores": 2, "memory_gib": 8, "load": [0.1, 2.0],
            "date": "2026-11-27", "commit": "abc", "command": "./dev bench query", "runs": 1, "rows": [row]} | changed


class Tables(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("docs/evidence/page.md", PAGE)
        self.keep("query-m-2026-11-27.json", result())

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text, encoding="utf-8")

    def keep(self, name, value):
        self.write(f"bench/results/{name}", json.dumps(value))

    def page(self):
        return (self.root / "docs/evidence/page.md").read_text(encoding="utf-8")

    def test_the_pages_of_this_tree_agree_with_their_data(self):
        self.assertEqual(result_tables.check(ROOT), [])

    def test_a_table_that_differs_is_caught_and_written(self):
        (said,) = result_tables.check(self.root)
        self.assertIn("page.md: table queries: differs", said)
        result_tables.check(self.root, write=True)
        self.assertEqual(result_tables.check(self.root), [])
        self.assertIn("| locate | 51 | 60.2 | 1,230 | 9,000 |", self.page())
        self.assertIn("`m`, 27 November 2026, load 0.1 to 2, 1 run: `./dev bench query`.", self.page())
        self.write("docs/evidence/page.md", self.page().replace("| 51 |", "| 15 |"))
        self.assertEqual(len(result_tables.check(self.root)), 1)

    def test_each_machine_shows_its_newest_result(self):
        self.keep("query-m-2026-11-26.json", result(date="2026-11-26"))
        self.keep("query-n-2026-11-25.json", result(machine="n", date="2026-11-25"))
        result_tables.check(self.root, write=True)
        self.assertNotIn("26 November", self.page())
        self.assertIn("27 November", self.page())
        self.assertIn("`n`, 25 November", self.page())

    def test_a_table_without_data_or_of_no_name_is_caught(self):
        self.write("docs/evidence/page.md", PAGE.replace("queries", "dabs"))
        self.assertIn("no result has its part", *result_tables.check(self.root))
        self.write("docs/evidence/page.md", PAGE.replace("queries", "melons"))
        self.assertIn("there is no such table", *result_tables.check(self.root))

    def test_a_missed_target_is_said(self):
        row = {"figure": "f", "on": "x", "value": 7.5, "unit": "ms", "clock": "wall", "at_most": 5}
        self.assertIn("≤ 5 **missed**", "\n".join(result_tables.frames([row])))
        self.assertNotIn("missed", "\n".join(result_tables.frames([row | {"at_most": 8}])))

    def test_the_worst_figure_stands_for_all_of_its_threshold(self):
        def row(figure, value, **bound):
            return {"test": "S1", "title": "t", "figure": figure, "value": value, "unit": "N", "holds": True} | bound
        text = "\n".join(result_tables.safety([row("a", 1, at_most=3), row("b", 2, at_most=3), row("c", 9, at_least=8), row("d", 8.5, at_least=8)]))
        self.assertIn("| S1 | b (worst of 2) | 2 N | ≤ 3 N |", text)
        self.assertIn("| S1 | d (worst of 2) | 8.5 N | ≥ 8 N |", text)


if __name__ == "__main__":
    unittest.main()
