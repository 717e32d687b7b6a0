"""The table of conversions: one row per model with what it took, what it gave, and why where it gave nothing."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent.parent / "bench" / "convert_table.py"
sys.path.insert(0, str(SCRIPT.parent))
sys.path.insert(0, str(SCRIPT.parent.parent / "tools"))
import convert_table  # noqa: E402
import result_tables  # noqa: E402
import results  # noqa: E402


def table(*arguments):
    return subprocess.run([sys.executable, str(SCRIPT), "--bin", os.environ["RELIEF_BIN"], *map(str, arguments)],
                          capture_output=True, text=True, timeout=250, check=False)


class Table(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_rows_hold_what_the_commands_said_and_used(self):
        run = table("--only", "torus", "--triangles", 3000, "--samples", 7, "--out", self.folder / "out")
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        (row,) = json.loads((self.folder / "out/table.json").read_text())["rows"]
        self.assertEqual((row["model"], row["target"], row["triangles"]), ("torus (sample)", 200, 3000))
        self.assertTrue(row["verified"])
        self.assertEqual(row["convert"]["mode"], row["verify"]["mode"])
        self.assertGreater(row["cpu_s"], 0.5 * row["convert"]["seconds"])
        self.assertGreater(row["peak_mib"], 1)
        text = (self.folder / "out/table.md").read_text()
        self.assertEqual(run.stdout, text)
        self.assertIn(f"| torus (sample) | 3,000 | {row['convert']['slabs']:,} (200) | certified |", text)

    def test_solids_are_rows_and_scans_that_are_absent_are_named(self):
        solids = {"bool_coplanar_overlap", "box1", "cup_0.01", "hair_cards", "klein", "outlier_tri", "overlapping_two", "plate_box",
                  "sunk_8", "text_bars", "thin_hollow_0.01"}
        self.assertLessEqual(solids, set(convert_table.SCANS))
        box = "OFF\n8 6 0\n" + "".join(f"{x} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1))
        (self.folder / "box1.off").write_text(box + "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n")
        run = table(self.folder, "--only", "box1", "sunk_8", "klein", "--samples", 7, "--out", self.folder / "out")
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        kept = json.loads((self.folder / "out/table.json").read_text())
        self.assertEqual([(row["model"], row["verified"]) for row in kept["rows"]], [("box1", True)])
        self.assertEqual(kept["skipped"], ["klein", "sunk_8"])
        self.assertTrue(run.stdout.endswith(f"\nSkipped, not in {self.folder}: klein, sunk_8.\n"), run.stdout)
        run = table("--only", "torus", "klein", "--triangles", 3000, "--samples", 7, "--out", self.folder / "out")
        self.assertTrue(run.stdout.endswith("\nSkipped, as no folder of scans was given: klein.\n"), run.stdout)

    def test_an_older_program_is_compared_in_the_same_run(self):
        run = table("--only", "torus", "--triangles", 3000, "--samples", 7, "--out", self.folder, "--json",
                    "--before", os.environ["RELIEF_BIN"])
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        (row,) = json.loads(run.stdout)["rows"]
        self.assertEqual(row["goals"]["mode"], "certified")
        self.assertEqual(row["before"]["content_hash"], row["content_hash"])
        self.assertTrue(row["before"]["verified"])
        self.assertEqual({k: row["changes"][k] for k in ("same_content", "slabs", "greatest")},
                         {"same_content": True, "slabs": 1, "greatest": 1})

    def test_an_older_program_that_says_less_is_compared_in_what_it_says(self):
        # It converts as this one does, and its JSON has neither distances nor fibres nor, in the end, slabs.
        old = self.folder / "relief"
        for missing in (("distance", "hits"), ("distance", "hits", "slabs", "mode")):
            old.write_text(f"""#!{sys.executable}
import json, os, subprocess, sys
run = subprocess.run([os.environ["RELIEF_BIN"], *sys.argv[1:]], capture_output=True, text=True)
said = json.loads(run.stdout)
print(json.dumps({{k: v for k, v in said.items() if k not in {("content_hash",) + missing}}}))
sys.exit(run.returncode)
""")
            old.chmod(0o755)
            run = table("--only", "torus", "--triangles", 3000, "--samples", 7, "--out", self.folder, "--before", old)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            (row,) = json.loads((self.folder / "table.json").read_text())["rows"]
            changes = row["changes"]
            self.assertEqual((changes["same_content"], changes["greatest"]), (None, None))
            self.assertEqual(changes["slabs"], None if "slabs" in missing else 1)
            self.assertGreater(changes["cpu"], 0)
            self.assertIn("unknown, unknown, unknown, " if "slabs" in missing else " certified, ", run.stdout)

    def test_scans_are_found_by_name_and_a_refused_one_keeps_its_row(self):
        scans = self.folder / "scans/below"
        scans.mkdir(parents=True)
        (scans / "skull.ply").write_text("ply\nno mesh\n")
        (scans / "other.ply").write_text("not looked at")
        run = table(self.folder / "scans", "--only", "skull", "--out", self.folder)
        self.assertEqual(run.returncode, 1)
        (row,) = json.loads((self.folder / "table.json").read_text())["rows"]
        self.assertEqual((row["model"], row["status"]), ("skull", 1))
        self.assertIn("skull.ply", row["error"])
        self.assertIn("- skull: ", (self.folder / "table.md").read_text())

    def test_a_broken_must_is_said_and_is_1(self):
        # A cube by the name of a scan, with more memory than its twelve triangles may take, else as it must be.
        corners = "".join(f"{x} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1))
        faces = "0 2 3, 0 3 1, 4 5 7, 4 7 6, 0 1 5, 0 5 4, 2 6 7, 2 7 3, 0 4 6, 0 6 2, 1 3 7, 1 7 5"
        (self.folder / "bunny.off").write_text("OFF\n8 12 0\n" + corners + "".join(f"3 {f}\n" for f in faces.split(", ")))
        convert_table.MEMORY, convert_table.MUSTS = (2**20, 0), {"bunny": (150, 60, 1e-3)}
        arguments = [str(self.folder), "--bin", os.environ["RELIEF_BIN"], "--only", "bunny", "--out", str(self.folder / "out")]
        self.assertEqual(convert_table.main(arguments), 1)
        (row,) = json.loads((self.folder / "out/table.json").read_text())["rows"]
        self.assertTrue(row["verified"])
        self.assertEqual(len(row["broken_musts"]), 1)
        self.assertIn("MiB, must be 1 at most", row["broken_musts"][0])
        self.assertIn("- bunny breaks a must: ", (self.folder / "out/table.md").read_text())
        convert_table.MEMORY = (2**31, 0)
        self.assertEqual(convert_table.main(arguments), 0)
        convert_table.MUSTS = {"bunny": (8, None, None)}
        convert_table.LARGE, convert_table.EACH = {"bunny"}, 1e-6
        self.assertEqual(convert_table.main(arguments), 1)
        (row,) = json.loads((self.folder / "out/table.json").read_text())["rows"]
        self.assertEqual([said.split(", must be ")[1] for said in row["broken_musts"]], ["8 at most", "1.2e-05 at most"])

    def test_every_file_is_converted_or_refused_with_a_sentence(self):
        scans = self.folder / "scans"
        scans.mkdir()
        (scans / "tetrahedron.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        (scans / "no_mesh.txt").write_text("no mesh\n")

        def rows(every, relief=os.environ["RELIEF_BIN"]):
            convert_table.EVERY = every
            status = convert_table.main([str(scans), "--every", "--bin", str(relief), "--out", str(self.folder / "out")])
            return status, json.loads((self.folder / "out/table.json").read_text())["rows"]
        status, (refused, converted) = rows((60, 2**31))
        self.assertEqual((status, refused["status"], converted["status"], converted["verified"]), (0, 1, 0, True))
        self.assertIn("no_mesh.txt", refused["error"])
        self.assertEqual([row["model"] for row in (refused, converted)], ["scans/no_mesh.txt", "scans/tetrahedron.off"])
        kept = json.loads((self.folder / "out/table.json").read_text())
        self.assertEqual((kept["goals"], kept["missed"]), ({"cpu_s": 60, "peak_mib": 2**31}, 0))
        for every, what in (((0, 2**31), "CPU s, must be 0 at most"), ((60, 1), "MiB, must be 1 at most")):
            status, both = rows(every)
            self.assertEqual(status, 1)
            self.assertTrue(all(what in row["broken_musts"][0] for row in both))
        # Programs that refuse with two lines, and that crash.
        for body in ("echo 'relief: one' >&2; echo two >&2; exit 1", "kill -SEGV $$"):
            broken = self.folder / "relief"
            broken.write_text(f"#!/bin/sh\n{body}\n")
            broken.chmod(0o755)
            status, both = rows((60, 2**31), broken)
            self.assertEqual(status, 1)
            self.assertTrue(all("neither converted nor refused" in row["broken_musts"][0] for row in both))
            self.assertEqual(json.loads((self.folder / "out/table.json").read_text())["missed"], 2)

    def test_a_refusal_is_one_line_of_one_sentence(self):
        def is_refusal(error, status=1):
            return convert_table.is_refusal({"status": status, "error": error})
        self.assertTrue(is_refusal("relief: a.ply: holds no faces; export it again"))
        self.assertTrue(is_refusal("relief: a.obj: line 11: '3.1+e2' is not a number"))
        self.assertFalse(is_refusal("relief: a.ply: holds no faces. Export it again"))
        self.assertFalse(is_refusal("relief: a.ply: holds no faces\nexport it again"))
        self.assertFalse(is_refusal("holds no faces"))
        self.assertFalse(is_refusal("relief: a.ply: holds no faces", -11))

    def test_a_model_that_verify_does_not_confirm_misses_a_goal(self):
        (self.folder / "scans").mkdir()
        (self.folder / "scans/tetrahedron.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        doubting = self.folder / "relief"
        doubting.write_text(f"""#!/bin/sh
[ "$1" = verify ] && echo 'relief: it does not hold' >&2 && exit 1
exec '{os.environ["RELIEF_BIN"]}' "$@"
""")
        doubting.chmod(0o755)
        run = subprocess.run([sys.executable, str(SCRIPT), str(self.folder / "scans"), "--every", "--bin", str(doubting), "--json",
                              "--out", str(self.folder / "out")], capture_output=True, text=True, timeout=250, check=False)
        self.assertEqual(run.returncode, 1)
        said = json.loads(run.stdout)
        self.assertEqual(said["missed"], 1)
        self.assertIn("verify does not confirm", said["rows"][0]["broken_musts"][0])

    def test_the_kept_rows_say_what_became_of_each_file(self):
        (self.folder / "scans/solids").mkdir(parents=True)
        (self.folder / "scans/solids/ball.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
        (self.folder / "scans/no_mesh.txt").write_text("no mesh\n")
        run = table(self.folder / "scans", "--every", "--out", self.folder / "out")
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        rows = list(results.file_rows(json.loads((self.folder / "out/table.json").read_text())))
        figures = {row["figure"]: row for row in rows if "figure" in row}
        self.assertEqual([row["value"] for row in rows[:3]], [0, 0, 0])
        self.assertEqual((figures["memory, the largest file"]["at_most"], figures["CPU seconds, the slowest file"]["at_most"]), (2048, 30))
        refused, converted = rows[len(figures):]
        self.assertEqual((refused["file"], refused["outcome"]), ("scans/no_mesh.txt", "refused"))
        self.assertFalse(refused["said"].startswith(("relief", "/")), refused["said"])
        self.assertEqual((converted["file"], converted["outcome"], converted["verified"]), ("scans/solids/ball.off", "certified", True))
        self.assertTrue(converted["said"].startswith("Certified; within "))
        self.assertLess(converted["bound"], 0.01)
        self.assertIn("all that certified mode claims holds", "\n".join(result_tables.solids(rows)))
        self.assertIn("| `scans` | 1 | 0 | 0 | 1 |", "\n".join(result_tables.outcomes(rows)))
        self.assertEqual(results.without_content("line 11: '3.1+e2' is not a number"), "line 11: '...' is not a number")
        self.assertIn("| `scans/no_mesh.txt` | refused |", "\n".join(result_tables.told_of_files(rows)))

    def test_wrong_usage_is_2(self):
        self.assertEqual(table("--every").returncode, 2)
        self.assertEqual(table(self.folder, "--every", "--only", "bunny").returncode, 2)
        self.assertEqual(table(self.folder, "--every").returncode, 2)  # no file
        self.assertEqual(table("--only", "melon").returncode, 2)
        self.assertEqual(table(self.folder / "gone").returncode, 2)

    def test_a_folder_without_known_scans_is_refused_with_a_sentence(self):
        (self.folder / "other.ply").write_text("not looked at")
        run = table(self.folder, "--out", self.folder / "out")
        self.assertEqual(run.returncode, 2)
        self.assertIn("holds no scan with a known name", run.stderr)
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
