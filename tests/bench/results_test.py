"""What is kept of a run: one object with machine, load, date and rows, and one row per line."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

BENCH = pathlib.Path(__file__).resolve().parent.parent.parent / "bench"
sys.path.insert(0, str(BENCH))
import results  # noqa: E402

PROGRAMS = pathlib.Path(os.environ["RELIEF_BIN"]).parent


class Results(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def form_of(self, part):
        """What the benchmark says of a part in its shortest form."""
        run = subprocess.run([PROGRAMS / "relief-bench", part, "--form", "--json"], capture_output=True, text=True, check=True)
        return json.loads(run.stdout)[part]

    def test_rows_of_touch_hold_figures_peers_and_growth(self):
        rows = list(results.touch_rows(self.form_of("touch")))
        figure = next(row for row in rows if row.get("figure") == "whole tick, p99.9")
        self.assertEqual((figure["at_most"], figure["clock"]), (10, "thread CPU"))
        self.assertLessEqual(figure["p50"], figure["p90"])
        self.assertLessEqual(figure["p90"], figure["p99"])
        peers = {row["peer"].split(" ")[0] for row in rows if "peer" in row}
        self.assertLessEqual({"Relief,", "Embree", "OpenVDB", "CGAL"}, peers)
        self.assertTrue(any("wrong_side" in row for row in rows))
        self.assertEqual({row["query"] for row in rows if "slabs" in row}, {"locate", "probe"})

    def test_a_result_says_where_and_when_and_replaces_the_older_one(self):
        kept = results.measure("render", "./dev bench render", lambda: list(results.figure_rows(self.form_of("render"))), 1)
        self.assertEqual(list(kept), ["bench", "machine", "cpu", "cores", "memory_gib", "load", "date", "commit", "command", "runs", "rows"])
        older = self.folder / f"render-{kept['machine']}-2020-01-01.json"
        other = self.folder / "render-another-2020-01-01.json"
        older.write_text("{}"), other.write_text("{}")
        file = results.keep(kept, self.folder)
        self.assertEqual(sorted(self.folder.iterdir()), sorted([file, other]))
        text = file.read_text(encoding="utf-8")
        self.assertEqual(json.loads(text), kept)
        self.assertEqual(sum(line.startswith('  {"figure"') for line in text.splitlines()), len(kept["rows"]))

    def test_numbers_of_several_runs_are_medians(self):
        runs = [[{"name": "a", "value": value, "p": [value, 1]}] for value in (3.0, 1.0, 2.0)]
        self.assertEqual(results.middle(runs), [{"name": "a", "value": 2.0, "p": [2.0, 1]}])
        with self.assertRaises(SystemExit):
            results.middle([[1], [1, 2]])

    def test_four_digits_are_kept(self):
        self.assertEqual(results.short({"a": 1.23456, "b": [0.000123456, 7.0], "c": "x", "d": 123456, "e": True}),
                         {"a": 1.235, "b": [0.0001235, 7], "c": "x", "d": 123456, "e": True})

    def test_an_unknown_part_is_wrong_usage(self):
        run = subprocess.run([sys.executable, BENCH / "results.py", "melon", "--bin", PROGRAMS], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 2)
        self.assertIn("melon", run.stderr)

    def test_acceptance_compares_its_thresholds_with_the_kept_ones(self):
        def acceptance(*arguments):
            return subprocess.run([PROGRAMS / "acceptance", "S1", *arguments], capture_output=True, text=True, check=False)
        file = self.folder / "safety-m-2026-01-01.json"
        self.assertEqual(acceptance("--kept", self.folder).returncode, 1)  # there is none
        self.assertEqual(acceptance("--json", file).returncode, 0)
        self.assertEqual(acceptance("--kept", self.folder).returncode, 0)
        said = json.loads(file.read_text())
        said["rows"][0]["at_most"] *= 2
        file.write_text(json.dumps(said))
        run = acceptance("--kept", self.folder)
        self.assertEqual(run.returncode, 1)
        self.assertIn(f"not so in {file.name}", run.stdout)


if __name__ == "__main__":
    unittest.main()
