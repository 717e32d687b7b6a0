"""The keys of json.md and the columns of csv.md, held against what the program writes: formats_test.py PAGES_FOLDER."""

import collections
import contextlib
import json
import os
import pathlib
import re
import shutil
import sqlite3
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "reference"
RELIEF = pathlib.Path(os.environ["RELIEF_BIN"]) / "relief"

# The place of the sample torus that is farthest along x, in its units.
REACHED = (49.88, 53.41, 0)

# Keys that no cheap run prints.
SELDOM = {
    "convert": ("not_certified", "certificate.*.at_least", "parts.obstacles.part", "parts.obstacles.triangles",
                "parts.obstacles.near", "parts.obstacles.reason", "mended.replaced_widest", "mended.replaced_near",
                "undecided.share", "undecided.near", "remesh.lost_near"),
    "verify": ("certificate.*.at_least", "failed_tiles.what", "failed_tiles.slabs"),
    "touch": ("outputs.lost", "losses.tick", "losses.seconds", "losses.over", "losses.reopened", "losses.reason"),
    "replay": ("gaps.first", "gaps.ticks", "cut.bytes", "cut.of", "unknown", "verification.difference.tick",
               "verification.difference.t", "verification.difference.field", "verification.difference.recorded",
               "verification.difference.now", "verification.stopped", "verification.missing"),
}
# Of the table `ticks` itself.
TABLE_COLUMNS = {"first", "count", "hash", "data"}

SPAN = re.compile(r"`([^`]+)`")


def documented(page, heading):
    """The names in the first column of the tables under a heading of level 2; `.b` after `a.c` in a cell is `a.b`."""
    section = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page, re.M | re.S)
    if section is None:
        return set()
    names, rows = set(), [line for line in section.group(1).splitlines() if line.startswith("|")]
    for row in rows:
        parent = ""
        for name in SPAN.findall(row.split("|")[1]):
            if name.startswith("."):
                name = parent + name
            parent = name.rpartition(".")[0]
            names.add(name)
    return names


def leaves(value, path=""):
    """The path and emptiness of every leaf of a JSON value; the elements of a list have the path of the list."""
    if isinstance(value, dict) and value:
        for key, part in value.items():
            yield from leaves(part, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value:
        for part in value:
            yield from leaves(part, path)
    else:
        yield path, value is None or value == [] or value == {}


def matches(pattern, path):
    parts, names = pattern.split("."), path.split(".")
    return len(parts) == len(names) and all(p in ("*", n) for p, n in zip(parts, names))


def differences(patterns, printed):
    """(leaves that no pattern names, patterns that no leaf has)."""
    unnamed = set()
    for path, empty in printed:
        known = any(matches(p, path) or (empty and matches(".".join(p.split(".")[:path.count(".") + 1]), path)) for p in patterns)
        if not known:
            unnamed.add(path)
    unseen = {p for p in patterns if not any(matches(p, path) for path, _ in printed)}
    return sorted(unnamed), sorted(unseen)


def write_obj(file, *boxes):
    """Boxes as (x, y, z, edge) with 12 triangles each."""
    lines, corners = [], 0
    for x, y, z, edge in boxes:
        lines += [f"v {x + edge * (k & 1)} {y + edge * (k >> 1 & 1)} {z + edge * (k >> 2)}" for k in range(8)]
        for a, b, c, d in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
            a, b, c, d = (k + 1 + corners for k in (a, b, c, d))
            lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
        corners += 8
    file.write_text("\n".join(lines) + "\n")


class Formats(unittest.TestCase):
    """Runs the commands once, in one folder, and keeps what they print by the command's name."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.at = pathlib.Path(cls.folder.name)
        cls.json_page = (PAGES / "json.md").read_text(encoding="utf-8")
        cls.csv_page = (PAGES / "csv.md").read_text(encoding="utf-8")
        cls.printed = collections.defaultdict(set)
        cls.make_files()
        cls.run_model_commands()
        cls.run_touch_commands()
        cls.run_failures()
        cls.run_batch()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def run_json(cls, *words, status=0):
        """The object that a command prints with --json; its leaves are kept by command, what a failure says apart."""
        ended = subprocess.run([RELIEF, *map(str, words), "--json"], cwd=cls.at, capture_output=True, text=True, timeout=300,
                               check=False)
        assert ended.returncode == status, f"{words}: {ended.returncode}, {ended.stdout} {ended.stderr}"
        value = json.loads(ended.stdout)
        if status and "error" in value:
            cls.printed["Failure"].update(leaves({"error": value.pop("error")}))
        if value:
            cls.printed[words[0]].update(leaves(value))

    @classmethod
    def make_files(cls):
        write_obj(cls.at / "boxes.obj", (0, 0, 0, 1), (0.4, 0.3, 0.2, 1))
        write_obj(cls.at / "stray.obj", (0, 0, 0, 1), (5000, 0, 0, 0.001))
        (cls.at / "strokes.json").write_text(json.dumps([
            {"tool": "paint", "radius": 8, "colour": [255, 0, 0], "points": [[0, *REACHED, 1]]},
            {"tool": "carve", "radius": 30, "points": [[0, *REACHED, 1], [0.1, *REACHED, 1]]}]))
        rows = [(k / 1000, REACHED[0] + 4 - 0.08 * min(k, 200 - k), *REACHED[1:]) for k in range(200)]
        for name, header, rest in (("press.csv", "t,x,y,z", ""), ("turned.csv", "t,x,y,z,qw,qx,qy,qz", ",1,0,0,0")):
            lines = [",".join(map(str, row)) + rest for row in rows]
            (cls.at / name).write_text("\n".join([header, *lines]) + "\n")
        (cls.at / "points.csv").write_text("x,y,z\n0,0,0\n0,0,1\n")

    @classmethod
    def run_model_commands(cls):
        cls.run_json("sample", "torus", "--triangles", 1000, "-o", "torus.ply")
        cls.run_json("convert", "torus.ply", "-o", "torus.relief", "--slabs", 60, "--mended", "mended.ply")
        cls.run_json("convert", "boxes.obj", "-o", "boxes.relief", "--samples", 4)
        cls.run_json("convert", "stray.obj", "-o", "stray.relief", "--samples", 4)
        cls.run_json("convert", "torus.ply", "-o", "solid.relief", "--samples", 4, "--remesh=0.05")
        cls.run_json("verify", "torus.relief")
        cls.run_json("verify", "torus.relief", "--source", "mended.ply")
        cls.run_json("verify", "torus.relief", "--source", "stray.obj", status=1)
        cls.run_json("info", "torus.ply")
        cls.run_json("info", "torus.relief")
        cls.run_json("sculpt", "torus.relief", "--strokes", "strokes.json", "-o", "carved.relief")
        cls.run_json("sculpt", "torus.relief", "--strokes", "strokes.json", "-o", "carved.relief", "--resume")
        cls.run_json("info", "carved.relief", "--strokes")
        cls.run_json("undo", "carved.relief")
        cls.damage("carved.relief", "damaged.relief")
        cls.run_json("info", "damaged.relief", "--strokes")
        cls.run_json("info", "damaged.relief", "--salvage", "-o", "saved.relief")
        cls.run_json("redo", "carved.relief")
        cls.run_json("refine", "carved.relief", "-o", "fine.relief", "--where", "all")
        cls.run_json("render", "torus.relief", "-o", "torus.png", "--size", "32x32", "--lights", 1)
        cls.run_json("render", "torus.relief", "-o", "torus.png", "--size", "32x32", "--lights", 1, "--parallel", 100)
        cls.run_json("render", "torus.ply", "-o", "torus.png", "--size", "32x32", "--debug", "repaired")
        cls.run_json("export", "torus.relief", "torus.obj")
        cls.run_json("devices")
        cls.run_json("help", "convert")
        cls.run_json("help", "flags")

    @classmethod
    def damage(cls, model, copy):
        """A copy of a model whose second stroke, which is undone, cannot be read."""
        shutil.copy(cls.at / model, cls.at / copy)
        with contextlib.closing(sqlite3.connect(cls.at / copy)) as db, db:
            db.execute("UPDATE pages SET hash = hash + 1 WHERE stroke = 2")

    @classmethod
    def run_touch_commands(cls):
        cls.run_json("touch", "torus.relief", "--path", "press.csv", "-o", "force.csv", "--record", "press.rlog")
        cls.run_json("touch", "torus.relief", "--path", "turned.csv", "--tool-points", "points.csv", "-o", "torque.csv")
        cls.run_json("touch", "torus.relief", "--device", "sim:hand", "--seconds", 0.2, "-o", "live.csv")
        cls.run_json("touch", "torus.relief", "--device", "replay:press.rlog", "-o", "again.csv")
        cls.run_json("touch", "torus.relief", "--path", "press.csv", "-o", "/dev/full", status=1)
        cls.run_json("sculpt", "carved.relief", "--device", "sim:hand", "--tool", "smooth", "--seconds", 0.2)
        cls.run_json("replay", "press.rlog", "--verify", "--csv", "ticks.csv")
        cls.run_json("replay", "press.rlog", "--stiffness", 100)

    @classmethod
    def run_failures(cls):
        for words, status in ((("info", "missing.relief"), 1), (("info",), 2), (("convert", "torus.ply", "--slabs", 1), 2)):
            cls.run_json(*words, status=status)

    @classmethod
    def run_batch(cls):
        """One scan that is done and one that fails; the report in a record is that of convert."""
        (cls.at / "scans").mkdir()
        shutil.copy(cls.at / "torus.ply", cls.at / "scans")
        (cls.at / "scans" / "empty.obj").write_text("# nothing\n")
        cls.run_json("batch", "scans", "-o", "models", "--slabs", 60, "--samples", 4, status=1)
        for record in (cls.at / "models").glob("*.report.json"):
            value = json.loads(record.read_text(encoding="utf-8"))
            cls.printed["The record of a scan"].update(leaves({**value, "report": None}))

    def test_json_page(self):
        """Both ways; of the seldom keys only that the program has them."""
        for command in sorted(self.printed):
            with self.subTest(command=command):
                patterns = documented(self.json_page, command)
                self.assertTrue(patterns, f"json.md has no section {command}")
                unnamed, unseen = differences(patterns, self.printed[command])
                self.assertFalse(unnamed, f"json.md does not name these keys of {command}")
                unseen = [key for key in unseen if key not in SELDOM.get(command, ())]
                self.assertFalse(unseen, f"{command} prints no such keys as json.md names")

    def test_seldom_keys(self):
        sources = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "apps" / "relief").glob("*.cpp"))
        for key in {part for keys in SELDOM.values() for path in keys for part in path.split(".") if part != "*"}:
            self.assertTrue(f'"{key}"' in sources, f"json.md names {key}, which the program does not have")

    def test_a_key_that_is_missing_is_found(self):
        printed = set(leaves({"a": {"b": 1, "c": [{"d": 2}]}, "e": None}))
        self.assertEqual((["a.c.d"], ["e.x", "f"]), differences({"a.b", "e.x", "f"}, printed))
        self.assertEqual(([], []), differences({"a.b", "a.c.*", "e"}, printed))

    def header_of(self, file):
        return (self.at / file).read_text(encoding="utf-8").partition("\n")[0].split(",")

    def columns(self, heading):
        """The columns of a table of csv.md, in order."""
        section = re.search(rf"^## {heading}\n(.*?)^## ", self.csv_page, re.M | re.S).group(1)
        return [name for row in section.splitlines() if row.startswith("| `") for name in SPAN.findall(row.split("|")[1])]

    def test_csv_columns(self):
        self.assertEqual(self.header_of("turned.csv"), self.columns("Path"))
        self.assertEqual(self.header_of("points.csv"), self.columns("Tool points"))
        self.assertEqual(self.header_of("torque.csv"), self.columns("Forces"))
        self.assertEqual(self.header_of("force.csv"), self.columns("Forces")[:-3])

    def test_columns_of_a_recording(self):
        page = (PAGES / "recording.md").read_text(encoding="utf-8")
        section = re.search(r"^### ticks\n(.*?)^### ", page, re.M | re.S).group(1)
        named = {name for row in section.splitlines() for name in SPAN.findall(row.split("|")[1] if "|" in row else "")}
        columns = {re.sub(r"(\.[wxyz])?( \[.*\])?$", "", name) for name in self.header_of("ticks.csv")}
        self.assertEqual(columns - {"tick"}, named - TABLE_COLUMNS)

    def check_tables(self, file, page, heading):
        """Each column of each table of a database, and each key of its table of facts, has a row on the page."""
        page = (PAGES / page).read_text(encoding="utf-8")
        with contextlib.closing(sqlite3.connect(self.at / file)) as db:
            tables = [name for (name,) in db.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")]
            self.assertGreater(len(tables), 3)
            for table in tables:
                section = re.search(rf"^{heading.format(table)}\n(.*?)^##", page, re.M | re.S)
                self.assertTrue(section, f"no section on table {table}")
                firsts = [line.split("|")[1] for line in section.group(1).splitlines() if line.startswith("|")]
                named = {name for cell in firsts for name in re.findall(r"\w+", cell)}
                columns = {row[1] for row in db.execute(f"PRAGMA table_info({table})")}
                if "key" in columns:
                    columns |= {key for (key,) in db.execute(f"SELECT key FROM {table}")}
                self.assertFalse(columns - named, f"the section on {table} lacks these")

    def test_tables_of_a_model(self):
        self.check_tables("carved.relief", "model-file.md", "## Table `{}`")

    def test_tables_of_a_recording(self):
        self.check_tables("press.rlog", "recording.md", "### {}")

    def test_fields_of_strokes(self):
        known = re.search(r"kFields = \{(.*?)\};", self.source("relief/session/stroke_text.cpp"), re.S).group(1)
        self.assertEqual(set(re.findall(r'"(\w+)"', known)), set(self.columns("Strokes")))

    def test_figures_of_a_simulated_hand(self):
        source, named = self.source("relief/devices/plant_file.cpp"), documented(self.csv_page, "The simulated hand")
        for part in ("plant", "device", "hand"):
            rows = re.search(rf"k{part.title()}\[\] = \{{(.*?)\}};", source, re.S).group(1)
            self.assertEqual({f"{part}.{name}" for name in re.findall(r'\{"(\w+)"', rows)},
                             {name for name in named if name.startswith(part + ".")})

    def test_flags(self):
        page = (PAGES / "haptics.md").read_text(encoding="utf-8")
        names = re.findall(r'return "([^"]+)";', self.source("relief/haptics/fault.cpp"))
        names = names[1:names.index("unknown")]
        self.assertEqual([(str(1 << bit), name) for bit, name in enumerate(names)],
                         re.findall(r"^\| (\d+) \| ([a-z ]+) \|", page, re.M))

    @staticmethod
    def source(file):
        return (ROOT / file).read_text(encoding="utf-8")


if __name__ == "__main__":
    unittest.main()
