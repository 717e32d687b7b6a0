"""`relief batch` as a museum meets it: a folder of good and bad scans, runs that are cut short, shards, the page."""

import html.parser
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
import urllib.parse

BIN = pathlib.Path(os.environ["RELIEF_BIN"])
DATA = pathlib.Path(os.environ.get("RELIEF_TEST_DATA", "no-such-folder"))
ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples" / "collection"
SANITIZED = os.environ.get("RELIEF_SANITIZED") == "1"
SOAK = os.environ.get("RELIEF_SOAK") == "1"
MODEL_KIB = 100  # about what a model, its record and its picture take with SMALL
SMALL = ("--slabs", "60", "--samples", "4")
ON_PATH = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}


def start(*args, **how):
    return subprocess.Popen([str(BIN / "relief"), *map(str, args)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, **how)


def relief(*args, stdin=None, **how):
    return subprocess.run([str(BIN / "relief"), *map(str, args)], input=stdin or "", capture_output=True, text=True,
                          timeout=600, check=False, **how)


class Page(html.parser.HTMLParser):
    """What index.html shows: addresses, rows of the failure table, names of the cards in their order."""

    def __init__(self, file):
        super().__init__()
        self.addresses, self.rows, self.cards, self.groups = [], [], [], []
        self.lines, self.tables = {}, []  # of each list; the group of each row
        self.at = ""
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        self.at = tag
        attributes = dict(attributes)
        self.addresses += [v for k, v in attributes.items() if k in ("src", "href") and not v.startswith("#")]
        if tag == "tr":
            self.rows.append([])
            self.tables.append(self.groups[-1])
        if tag == "li":
            self.lines.setdefault(self.groups[-1], []).append("")
        if tag == "td":
            self.rows[-1].append("")
        if tag == "h2":
            self.groups.append(attributes["id"])

    def handle_data(self, text):
        if self.at in ("td", "a") and self.rows and self.rows[-1]:
            self.rows[-1][-1] += text
        if self.at == "li":
            self.lines[self.groups[-1]][-1] += text
        if self.at == "h3" and text.strip():
            self.cards.append(text)

    def handle_endtag(self, tag):
        self.at = "" if tag != "a" else self.at

    def table(self, group):
        return [row for row, of in zip(self.rows, self.tables) if row and of == group]

    def failures(self):
        return self.table("failed")


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.sources = pathlib.Path(tempfile.mkdtemp(prefix="relief-batch-"))
        cls.addClassCleanup(shutil.rmtree, cls.sources)
        made = relief("sample", "pumpkin", "-o", cls.sources / "pumpkin.ply", "--triangles", 1000)
        assert made.returncode == 0, made.stderr

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="relief-batch-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.scans, self.out = self.folder / "scans", self.folder / "models"
        self.scans.mkdir()

    def good(self, *names):
        for name in names:
            (self.scans / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(self.sources / "pumpkin.ply", self.scans / name)

    def bad(self, name, text="ply\nformat ascii 1.0\n"):
        (self.scans / name).write_text(text, encoding="utf-8")

    def batch(self, *args, status=0, **how):
        run = relief("batch", self.scans, "-o", self.out, *SMALL, *args, **how)
        self.assertEqual(run.returncode, status, run.stdout + run.stderr)
        return run

    def summary(self, *args, status=0, **how):
        return json.loads(self.batch("--json", *args, status=status, **how).stdout)

    def record(self, name):
        return json.loads((self.out / f"{name}.report.json").read_text(encoding="utf-8"))

    def stamps(self):
        return {f.name: f.stat().st_mtime_ns for f in self.out.iterdir() if f.suffix == ".relief"}

    def assert_one_line(self, run, status, *words):
        self.assertEqual(run.returncode, status, run.stderr)
        self.assertEqual(run.stderr.count("\n"), 1, run.stderr)
        for word in words:
            self.assertIn(word, run.stderr)

    def assert_whole(self):
        """Every file of the folder is finished: models open, records parse, pictures end."""
        for file in self.out.iterdir():
            if file.suffix == ".relief":
                self.assertEqual(relief("info", file).returncode, 0, file)
            elif file.suffix == ".json":
                json.loads(file.read_text(encoding="utf-8"))
            elif file.suffix == ".png":
                self.assertTrue(file.read_bytes().endswith(b"IEND\xaeB`\x82"), file)
            else:
                self.assertEqual(file.name, "index.html")


class Collection(Case):
    def test_good_and_bad_scans(self):
        self.good("vase.ply", "greek/amphora.ply", "greek/Größe, 兔: 100 %.ply")
        self.bad("cut.ply")
        self.bad("notes.txt", "no mesh")
        self.bad("._vase.ply", "what another system leaves beside a file")
        run = self.batch(status=1)
        self.assert_one_line(run, 1, "1 of 4 scans failed", "index.html")
        self.assertIn("amphora: Certified;", run.stdout)
        self.assertIn("cut: failed: ", run.stdout)
        self.assertIn("4 scans: 3 done, 0 done before, 1 failed", run.stdout)
        self.assert_whole()
        names = {"vase", "amphora", "Größe, 兔: 100 %"}
        self.assertEqual({f.stem for f in self.out.glob("*.relief")}, names)
        self.assertEqual({f.stem for f in self.out.glob("*.png")}, names)
        done, failed = self.record("amphora"), self.record("cut")
        source = (self.scans / "greek" / "amphora.ply").stat()
        self.assertEqual((done["status"], done["scan"]), ("done", str(self.scans / "greek" / "amphora.ply")))
        self.assertEqual(done["bytes"], source.st_size)
        self.assertTrue(done["modified"].endswith(f"{source.st_mtime_ns % 10**9:09}Z"), done["modified"])
        self.assertEqual(done["options"], list(SMALL))
        self.assertEqual(done["report"]["mode"], "certified")
        self.assertIsNone(done["failure"])
        self.assertEqual((failed["status"], failed["failure"]["exit_status"]), ("failed", 1))
        self.assertIn("cut.ply", failed["failure"]["message"])
        page = Page(self.out / "index.html")
        self.assertEqual(set(page.cards), names)
        self.assertEqual(page.groups, ["failed", "certified", "others"])
        self.assertEqual(page.lines, {"others": [str(self.scans / "notes.txt")]})
        self.assertEqual([row[:2] for row in page.failures()], [["cut", str(self.scans / "cut.ply")]])
        for address in page.addresses:
            self.assertTrue(address.startswith("./"), address)
            self.assertTrue((self.out / urllib.parse.unquote(address)).is_file(), address)

    def test_what_is_done_is_not_done_again(self):
        self.good("a.ply", "b.ply", "c.ply")
        self.bad("d.ply")
        self.batch(status=1)
        before = self.stamps()
        again = self.summary(status=1)
        self.assertEqual([again[k] for k in ("scans", "done", "skipped", "failed", "failed_before")], [4, 0, 3, 1, 1])
        self.assertEqual(self.stamps(), before)
        # A scan that was saved again, one whose model is cut short, one whose model is gone.
        os.utime(self.scans / "a.ply", (1, 1))
        whole = (self.out / "b.relief").read_bytes()
        (self.out / "b.relief").write_bytes(whole[:len(whole) // 2])
        (self.out / "c.relief").unlink()
        self.assertEqual(self.summary(status=1)["done"], 3)
        self.assertEqual(len((self.out / "b.relief.damaged").read_bytes()), len(whole) // 2)
        (self.out / "b.relief.damaged").unlink()
        self.assert_whole()
        # What failed is tried again when asked, or when it has changed.
        self.assertEqual(self.summary("--retry", status=1)["failed_before"], 0)
        self.good("d.ply")
        self.assertEqual(self.summary()["done"], 1)
        # Other options make other models.
        self.assertEqual(self.summary("--unit", "cm")["done"], 4)
        self.assertEqual(self.summary("--unit", "cm")["skipped"], 4)

    def test_strokes_are_not_lost(self):
        self.good("a.ply")
        self.batch()
        shutil.copy(ROOT / "examples" / "face.json", self.folder / "strokes.json")
        sculpted = relief("sculpt", self.out / "a.relief", "--strokes", self.folder / "strokes.json", "-o",
                          self.out / "a.relief")
        self.assertEqual(sculpted.returncode, 0, sculpted.stderr)
        self.assertEqual(self.summary()["skipped"], 1)
        self.batch("--unit", "m", status=1)
        self.assertIn("stroke", self.record("a")["failure"]["message"])
        self.assertEqual(self.summary("--unit", "m", "--retry", "--force")["done"], 1)

    def test_equal_names(self):
        self.good("greek/vase.ply", "roman/vase.ply", "roman/Vase.ply", "x/roman/vase.ply", "other.ply")
        self.assertEqual(self.summary()["done"], 5)
        names = {f.stem for f in self.out.glob("*.relief")}
        self.assertEqual(len({n.lower() for n in names}), 5, names)
        self.assertLessEqual({"other", "greek-vase"}, names)
        # They stay when the collection grows.
        self.good("late/other.ply")
        grown = self.summary()
        self.assertEqual((grown["done"], grown["skipped"]), (1, 5))
        self.assertEqual({f.stem for f in self.out.glob("*.relief")} - names, {"late-other"})
        # A collection that was moved is the same collection.
        self.scans = self.scans.rename(self.folder / "archive")
        moved = self.summary()
        self.assertEqual((moved["done"], moved["skipped"]), (0, 6))
        for file in self.out.glob("*.report.json"):
            self.assertTrue(json.loads(file.read_text(encoding="utf-8"))["scan"].startswith(str(self.scans)), file)
        # Another collection in the same folder replaces nothing.
        first, self.scans = self.scans, self.folder / "second"
        self.good("other.ply")
        self.assertEqual(self.summary()["done"], 1)
        self.assertEqual(len(list(self.out.glob("*.relief"))), 7)

    def test_shards_share_a_folder(self):
        self.good(*(f"{k}.ply" for k in range(7)))
        runs = [start("batch", self.scans, "-o", self.out, "--shard", f"{k}/3", "--jobs", 1, *SMALL) for k in (1, 2, 3)]
        counts = []
        for run in runs:
            out, err = run.communicate(timeout=600)
            self.assertEqual(run.returncode, 0, err)
            counts.append(int(re.search(r"(\d+) scans?:", out)[1]))
        self.assertEqual(counts, [3, 2, 2])
        self.assertEqual(sorted(Page(self.out / "index.html").cards), [str(k) for k in range(7)])
        self.assertEqual(self.summary()["skipped"], 7)

    def test_lists(self):
        self.good("a.ply", "b b.ply")
        listed = self.folder / "list.txt"
        listed.write_text("# two scans\r\nscans/a.ply\r\n\r\nscans/b b.ply\nscans/../scans/a.ply\nscans/c.ply\n",
                          encoding="utf-8")
        out = ("-o", self.out, *SMALL, "--json")
        run = relief("batch", listed, *out, cwd=self.folder)
        self.assert_one_line(run, 1, "1 of 3")
        self.assertIn("no such file", self.record("c")["failure"]["message"])
        self.good("c.ply")
        piped = relief("batch", "-", *out, cwd=self.folder, stdin=listed.read_text(encoding="utf-8"))
        self.assertEqual(piped.returncode, 0, piped.stderr)
        self.assertEqual((json.loads(piped.stdout)["done"], json.loads(piped.stdout)["skipped"]), (1, 2))

    def test_scans_that_are_gone_are_told_apart(self):
        self.good("a.ply", "b.ply")
        self.bad("cut.ply")
        self.batch(status=1)
        (self.scans / "b.ply").unlink()
        (self.scans / "cut.ply").unlink()
        self.batch()
        page = Page(self.out / "index.html")
        self.assertEqual((page.groups, page.cards), (["certified", "gone"], ["a", "b"]))
        self.assertEqual([row[:2] for row in page.table("gone")],
                         [["b", str(self.scans / "b.ply")], ["cut", str(self.scans / "cut.ply")]])
        self.assertIn("no model", page.table("gone")[1][2])
        text = (self.out / "index.html").read_text(encoding="utf-8")
        self.assertEqual(text.count("The scan is gone."), 1)
        # Scans that moved, good and bad, are where they are now.
        self.bad("late.ply")
        self.batch(status=1)
        self.scans = self.scans.rename(self.folder / "moved")
        self.batch(status=1)
        page = Page(self.out / "index.html")
        self.assertEqual([row[0] for row in page.table("gone")], ["b", "cut"])
        self.assertEqual([row[:2] for row in page.failures()], [["late", str(self.scans / "late.ply")]])

    def test_text_that_is_no_list_is_said_in_one_sentence(self):
        self.good("a.ply")
        notes = self.folder / "notes.txt"
        for text, line in (("Dear colleague,\nthe scans are on the drive.\n", "line 1"),
                           (f"{self.scans}/a.ply\n{self.scans}/a\n", "line 2"), ('{"scans": []}\n', "line 1")):
            notes.write_text(text, encoding="utf-8")
            run = relief("batch", notes, "-o", self.out, "--json")
            self.assert_one_line(run, 1, "notes.txt", line, "is no file", "a list is a text file with one path")
            self.assertEqual(json.loads(run.stdout)["error"]["file"], str(notes))
        self.assertFalse(self.out.exists())

    def test_what_cannot_be_begun(self):
        self.good("a.ply")
        out = ("-o", self.out)
        empty = self.folder / "empty"
        empty.mkdir()
        self.assert_one_line(relief("batch", empty, *out), 1, "empty", "holds no meshes")
        self.assert_one_line(relief("batch", self.scans, "-o", self.scans), 1, "scans", "-o another")
        self.assert_one_line(relief("batch", self.folder / "missing", *out), 1, "missing", "no such file")
        self.assert_one_line(relief("batch", self.scans / "a.ply", *out), 1, "a.ply", "relief convert")
        self.assert_one_line(relief("batch", "/dev/null", *out), 1, "/dev/null", "names no scans")
        binary = self.folder / "binary"
        binary.write_bytes(b"one.ply\ntwo\0three\n")
        self.assert_one_line(relief("batch", binary, *out), 1, "line 2", "one path on each line")
        self.assert_one_line(relief("batch", self.scans, "-o", binary), 1, "binary", "is a file")
        self.assertFalse(self.out.exists())
        # Options are judged before any scan is touched.
        for words, said in ((["--slabs", "2"], "--slabs"), (["--mode", "best"], "--mode"), (["--remesh=7"], "--remesh"),
                            (["--error", "1e-4", "--samples", "8"], "--samples"), (["--shard", "3/2"], "--shard"),
                            (["--shard", "0/2"], "--shard"), (["--shard", "2"], "--shard"), (["--jobs", "0"], "--jobs")):
            self.assert_one_line(relief("batch", self.scans, *out, *words), 2, said, "relief batch --help")
        self.assertFalse(self.out.exists())

    def test_a_folder_inside_the_other(self):
        self.good("a.ply")
        self.out = self.scans / "models"
        self.assertEqual(self.summary()["scans"], 1)
        self.assertEqual(relief("export", self.out / "a.relief", self.out / "a.ply").returncode, 0)
        self.assertEqual(self.summary()["scans"], 1)

    @unittest.skipIf(os.geteuid() == 0, "skipped: everything is readable for root")
    def test_folders_that_cannot_be_read_or_written(self):
        self.good("a.ply", "shut/b.ply")
        (self.scans / "shut").chmod(0)
        self.addCleanup((self.scans / "shut").chmod, 0o700)
        run = self.batch("--quiet", status=1)
        self.assert_one_line(run, 1, "shut", "cannot be read")
        page = Page(self.out / "index.html")
        self.assertEqual(page.groups, ["certified", "unreadable"])
        self.assertIn(str(self.scans / "shut"), page.lines["unreadable"][0])


class Limits(Case):
    def big(self, name):
        """A scan whose conversion takes long enough to be cut short."""
        made = relief("sample", "pumpkin", "-o", self.scans / name, "--triangles", 600_000)
        self.assertEqual(made.returncode, 0, made.stderr)

    def test_a_time_limit_stops_one_scan(self):
        self.big("big.ply")
        self.good("small.ply")
        run = relief("batch", self.scans, "-o", self.out, "--timeout", 0.05, "--slabs", 300)
        self.assertEqual(run.returncode, 1, run.stderr)
        failure = self.record("big")["failure"]
        self.assertTrue(failure["timed_out"])
        self.assertIn("--timeout", failure["message"])
        self.assertFalse((self.out / "big.relief").exists())
        self.assertIn("time limit", (self.out / "index.html").read_text(encoding="utf-8"))

    @unittest.skipIf(SANITIZED, "skipped: sanitizers reserve more memory than any limit")
    def test_a_memory_limit_stops_one_scan(self):
        self.big("big.ply")
        self.good("small.ply")
        run = self.batch("--memory", 180, "--threads", 1, status=1)
        self.assertIn("1 of 2", run.stderr)
        self.assertIn("180 MiB (--memory)", self.record("big")["failure"]["message"])
        self.assertEqual(self.record("small")["status"], "done")
        self.assert_whole()

    def wait_for_child(self, run):
        """The process that converts, once there is one."""
        for _ in range(6000):
            children = pathlib.Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text(encoding="ascii").split()
            if children:
                return int(children[0])
            time.sleep(0.01)
        self.fail("no scan was begun")

    def is_gone(self, pid):
        for _ in range(6000):
            try:
                if "\nState:\tZ" in pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii"):
                    return True
            except (FileNotFoundError, ProcessLookupError):
                return True
            time.sleep(0.01)
        return False

    def begin(self):
        self.good("a.ply")
        self.big("b.ply")
        run = start("batch", self.scans, "-o", self.out, "--jobs", 1, *SMALL)
        self.addCleanup(run.wait)
        self.addCleanup(run.kill)
        while not (self.out / "a.report.json").exists():
            self.assertIsNone(run.poll())
            time.sleep(0.01)
        return run, self.wait_for_child(run)

    def test_control_c_leaves_whole_files_only(self):
        run, child = self.begin()
        run.send_signal(signal.SIGINT)
        _, err = run.communicate(timeout=600)
        self.assertEqual(run.returncode, 130)
        self.assertIn("the same command continues it", err)
        self.assertTrue(self.is_gone(child))
        self.assert_whole()
        self.assertEqual({f.name for f in self.out.iterdir()}, {"a.relief", "a.report.json", "a.png", "index.html"})
        rest = self.summary()
        self.assertEqual((rest["done"], rest["skipped"]), (1, 1))
        self.assert_whole()

    def test_a_kill_ends_the_children_and_loses_no_scan(self):
        run, child = self.begin()
        run.kill()
        run.communicate()
        self.assertTrue(self.is_gone(child))
        rest = self.summary()
        self.assertEqual((rest["done"], rest["skipped"]), (1, 1))
        self.assert_whole()

    def test_a_crash_of_one_scan_stops_nothing(self):
        run, child = self.begin()
        self.good("c.ply")
        os.kill(child, signal.SIGSEGV)
        _, err = run.communicate(timeout=600)
        self.assertEqual(run.returncode, 1, err)
        self.assertEqual(self.record("b")["failure"]["signal"], signal.SIGSEGV)
        self.assertIn("crashed", self.record("b")["failure"]["message"])
        self.assertEqual(self.summary("--retry")["done"], 2)

    def test_a_full_disk_stops_the_run(self):
        self.good(*(f"{k}.ply" for k in range(8)))
        self.out.mkdir()
        mount = f"mount -t tmpfs -o size={MODEL_KIB * 3}k none '{self.out}'"
        if subprocess.run(["unshare", "-rm", "sh", "-c", mount], capture_output=True, check=False).returncode != 0:
            self.skipTest("skipped: no file system of its own")
        words = ["batch", self.scans, "-o", self.out, "--jobs", "1", *SMALL]
        run = subprocess.run(
            ["unshare", "-rm", "sh", "-c", f"{mount} && '{BIN / 'relief'}' \"$@\"; s=$?; cat '{self.out}'/*.json; exit $s",
             "sh", *map(str, words)], capture_output=True, text=True, check=False)
        self.assert_one_line(run, 1, "models", "the disk is full", "the same command continues")
        self.assertIn('"status": "done"', run.stdout)
        self.assertNotIn('"status": "failed"', run.stdout)


class Real(Case):
    def setUp(self):
        super().setUp()
        if not DATA.exists():
            self.skipTest("skipped: no test data")

    def test_bad_files(self):
        for kind in ("empty", "malformed", "truncated", "name", "degenerate"):
            (self.scans / kind).mkdir()
            for file in sorted((DATA / "b_bad" / kind).iterdir())[:SOAK and 100 or 4]:
                (self.scans / kind / file.name).symlink_to(file)
        run = relief("batch", self.scans, "-o", self.out, "--slabs", 100, "--timeout", 120, "--json")
        said = json.loads(run.stdout)
        self.assertEqual(said["done"] + said["failed"], said["scans"])
        self.assertGreater(said["done"], 0)
        self.assertGreater(said["failed"], 0)
        self.assertEqual(run.returncode, 1)
        records = [json.loads(f.read_text(encoding="utf-8")) for f in self.out.glob("*.report.json")]
        self.assertEqual(len(records), said["scans"])
        for record in records:
            if record["status"] == "failed":
                self.assertIsNone(record["failure"]["signal"], record)
                self.assertGreater(len(record["failure"]["message"]), 20)
        self.assertEqual(len(Page(self.out / "index.html").failures()), said["failed"])
        self.assert_whole()


# What stands in for Slurm: knows a few options, copies the script as Slurm does, and runs the array task by task.
SBATCH = """#!/usr/bin/env bash
set -euo pipefail
while read -r option value; do
  case $option in
    job-name) ;;
    array) [[ $value =~ ^1-([0-9]+)$ ]] && export SLURM_ARRAY_TASK_COUNT=${BASH_REMATCH[1]} ;;
    cpus-per-task) [[ $value =~ ^[0-9]+$ ]] && export SLURM_CPUS_PER_TASK=$value ;;
    mem) [[ $value =~ ^[0-9]+[KMGT]$ ]] ;;
    time) [[ $value =~ ^([0-9]+-)?[0-9]{2}:[0-9]{2}:[0-9]{2}$ ]] ;;
    *) echo "sbatch: there is no option --$option" >&2; exit 1 ;;
  esac
done < <(sed -n 's/^#SBATCH --\\([a-z-]*\\)=\\(.*\\)/\\1 \\2/p' "$1")
copy=$(mktemp)
trap 'rm -f "$copy"' EXIT
cp "$1" "$copy"
shift
for SLURM_ARRAY_TASK_ID in $(seq "$SLURM_ARRAY_TASK_COUNT"); do
  export SLURM_ARRAY_TASK_ID
  bash "$copy" "$@"
done
"""


class Examples(Case):
    """The files of examples/collection, as a cluster would run them, on this machine."""

    def setUp(self):
        super().setUp()
        self.good("a.ply", "greek/b.ply", "greek/c.ply")

    def example(self, *command, env=None):
        run = subprocess.run([*map(str, command)], cwd=self.folder, env={**ON_PATH, **(env or {})}, text=True,
                             stdin=subprocess.DEVNULL, capture_output=True, timeout=600, check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        return run.stdout

    def assert_done(self):
        self.assertEqual(sorted(Page(self.out / "index.html").cards), ["a", "b", "c"])
        self.assert_whole()

    def test_ten_lines(self):
        for name in ("parallel.sh", "slurm.sh", "Snakefile"):
            self.assertLessEqual(len((EXAMPLES / name).read_text(encoding="utf-8").splitlines()), 12, name)

    def test_parallel(self):
        if shutil.which("parallel") is None:
            self.skipTest("skipped: no GNU parallel")
        self.example(EXAMPLES / "parallel.sh", "scans", "models", "2")
        self.assert_done()

    def test_slurm(self):
        """The script is sound, asks for what Slurm knows, and its tasks do the whole collection."""
        script = EXAMPLES / "slurm.sh"
        subprocess.run(["bash", "-n", str(script)], check=True)
        sbatch = self.folder / "bin" / "sbatch"
        sbatch.parent.mkdir()
        sbatch.write_text(SBATCH, encoding="utf-8")
        sbatch.chmod(0o755)
        self.example(sbatch, script, "scans", "models")
        self.assert_done()

    @unittest.skipUnless(SOAK, "skipped: only in the long tests")
    def test_snakemake(self):
        if shutil.which("snakemake") is None:
            self.skipTest("skipped: no snakemake")
        self.example("snakemake", "--cores", 2, "--snakefile", EXAMPLES / "Snakefile", "--config", "scans=scans",
                     "models=models")
        self.assert_done()

    def test_container(self):
        """No container can be built here: each line is an instruction, what it copies and installs is there."""
        lines = (ROOT / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
        steps = [line.split(None, 1) for line in lines if line and not line.startswith("#")]
        self.assertEqual(steps[0], ["FROM", "debian:12 AS build"])
        self.assertLessEqual({name for name, _ in steps},
                             {"FROM", "RUN", "COPY", "WORKDIR", "USER", "ENTRYPOINT", "VOLUME", "ENV"})
        self.assertIn(["USER", "relief"], steps)
        self.assertEqual(json.loads(steps[-1][1]), ["relief"])
        self.assertEqual(steps[-1][0], "ENTRYPOINT")
        for name, rest in steps:
            if name == "RUN":
                subprocess.run(["sh", "-n", "-c", rest], check=True)
        installed = {word for name, rest in steps if "apt-get install" in rest for word in rest.split()}
        needed = subprocess.run(["ldd", BIN / "relief"], capture_output=True, text=True, check=True).stdout
        direct = subprocess.run(["readelf", "-d", BIN / "relief"], capture_output=True, text=True, check=True).stdout
        for library in set(re.findall(r"NEEDED.*\[(lib[^]]+)\]", direct)):
            path = os.path.realpath(re.search(rf"^\s*{re.escape(library)} => (\S+)", needed, re.M)[1])
            owner = subprocess.run(["dpkg", "-S", path], capture_output=True, text=True, check=False).stdout
            if owner and not owner.startswith(("libc6", "libgcc", "libasan", "libubsan", "libtsan")):
                self.assertIn(owner.partition(":")[0], installed, library)
        # Found by name when something is drawn: the loader's libraries, a driver that needs no card, a font for legends.
        self.assertLessEqual({"libgl1", "libegl1", "libgl1-mesa-dri", "fonts-inter"}, installed)


if __name__ == "__main__":
    unittest.main(verbosity=2)
