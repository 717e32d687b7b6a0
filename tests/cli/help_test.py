"""What the command line says of itself, how it refuses, and what it tells while it works."""

import json
import os
import pathlib
import pty
import re
import shlex
import shutil
import struct
import subprocess
import tempfile
import unittest
import zipfile

from cli_test import BIN, Run

COLUMNS = 100


def commands():
    return Run("help", "--json").json()["commands"]


def on_terminal(*args):
    """What a command writes to standard error when that is a terminal."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen([BIN / "relief", *map(str, args)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=theirs)
    os.close(theirs)
    text = b""
    while True:
        try:
            block = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not block:
            break
        text += block
    os.close(ours)
    process.wait()
    return text.decode()


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="relief-help-"))
        cls.scan = cls.folder / "torus.ply"
        cls.model = cls.folder / "torus.relief"
        for args in (["sample", "torus", "-o", cls.scan, "--triangles", 2000],
                     ["convert", cls.scan, "-o", cls.model, "--slabs", 60, "--samples", 4]):
            run = Run(*args)
            if run.status != 0:
                raise AssertionError(f"{args}: {run.err}")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)


class Help(Case):
    def test_each_command_has_a_group_and_two_to_four_examples(self):
        overview = Run("--help").out
        for command in commands():
            name = command["command"]
            self.assertTrue(command["group"], name)
            self.assertRegex(overview, rf"\n{command['group']}: +(\S+  )*{name}\b")
            self.assertTrue(2 <= len(command["examples"]) <= 4, name)
            names = {n for o in command["options"] for n in o["names"]}
            for example in command["examples"]:
                first = shlex.split(re.search(r"relief [^)|>]*", example["command"])[0])
                self.assertEqual(first[:2], ["relief", name], example)
                if name != "studio":  # whose options the studio reads
                    used = {word.split("=")[0] for word in first if re.match(r"-[a-z-]", word)}
                    self.assertLessEqual(used, names, example)

    def test_a_page_of_help_is_narrow_and_its_options_short(self):
        for command in commands():
            page = Run(command["command"], "--help")
            self.assertEqual((page.status, page.err), (0, ""))
            self.assertEqual(page.out, Run("help", command["command"]).out)
            for line in page.out.splitlines():
                self.assertLessEqual(len(line), COLUMNS, line)
            if "\nUsage: " in page.out:
                lines = page.out.split("\nUsage: ")[1].split("\n\nMore: ")[0].splitlines()
                text_lines = 0
                for line in lines:
                    text_lines = 1 if re.match(r" {2,6}(-|[A-Z]+  )", line) else text_lines + 1
                    if re.match(r" {20,}\S", line):
                        self.assertLessEqual(text_lines, 2, f"{command['command']}: {line}")

    def test_placeholders_say_the_kind_and_facts_stand_once(self):
        for command in commands():
            names = {n for o in command["options"] for n in o["names"]}
            for option in command["options"] + command["positionals"]:
                where = f"{command['command']} {option['names']}"
                self.assertNotIn(option["placeholder"], ("TEXT", "INT", "UINT", "FLOAT", "BOOLEAN"), where)
                self.assertTrue(option["meaning"] and not option["meaning"].endswith("."), where)
                self.assertNotIn("default", option["meaning"], where)
                self.assertLessEqual(set(option["needs"] + option["excludes"]), names, where)
        convert = {o["names"][-1]: o for o in Run("help", "convert", "--json").json()["options"]}
        slabs = convert["--slabs"]
        self.assertEqual((slabs["placeholder"], slabs["range"], slabs["default"]), ("N", "4 to 1000000", "200"))
        self.assertEqual(convert["--error"]["range"], "1e-7 to 1")
        self.assertEqual(convert["--error"]["excludes"], ["--samples"])
        self.assertEqual(convert["--unit"]["choices"], ["mm", "cm", "m", "in"])
        self.assertTrue(convert["--output"]["required"])
        self.assertRegex(Run("convert", "--help").out, r"--slabs N +slabs to aim for \[4 to 1000000, default 200\]\n")

    def test_topics(self):
        topics = Run("help", "--json").json()["topics"]
        self.assertEqual(topics, ["units", "flags", "path-csv", "strokes"])
        self.assertIn("relief help units | flags | path-csv | strokes | devices\n", Run("--help").out)
        self.assertIn("sim:hand:FILE.json", Run("help", "devices").out)
        for topic in topics:
            run = Run("help", topic)
            self.assertEqual((run.status, run.err), (0, ""))
            self.assertLessEqual(max(map(len, run.out.splitlines())), COLUMNS)
            self.assertEqual(Run("help", topic, "--json").json(), {"topic": topic, "text": run.out})
        rows = re.findall(r"^ +(\d+)  (\S.*?)  +\S", Run("help", "flags").out, re.M)
        self.assertEqual([int(value) for value, _ in rows], [1 << k for k in range(len(rows))])
        self.assertEqual(rows[17][1], "no news")
        header = Run("help", "path-csv").out.split("F.csv: the header ")[1].split("\n")[0]
        path, forces = self.folder / "p.csv", self.folder / "f.csv"
        path.write_text("t,x,y,z\n0,0,900,0\n")
        self.assertEqual(Run("touch", self.model, "--path", path, "-o", forces).status, 0)
        self.assertEqual(forces.read_text().splitlines()[0], header)
        self.assertEqual(forces.read_text().splitlines()[1].split(",")[5], "-1")

    def test_man_pages(self):
        if shutil.which("groff") is None:
            self.skipTest("no groff")
        for name in [None, *(c["command"] for c in commands())]:
            page = Run("help", *([name] if name else []), "--man").out
            drawn = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-P-c"], input=page, capture_output=True,
                                   text=True, check=True)
            self.assertEqual(drawn.stderr, "", name)
            for option in Run("help", name, "--json").json()["options"] if name else []:
                for each in option["names"]:
                    self.assertIn(each, re.sub(r".\x08", "", drawn.stdout).replace("‐", "-"), name)

    def test_completion(self):
        for shell in ("bash", "zsh", "fish"):
            script = self.folder / f"completion.{shell}"
            script.write_text(Run("completion", shell).out)
            if shutil.which(shell):
                checked = subprocess.run([shell, "-n", script], capture_output=True, text=True, check=False)
                self.assertEqual((checked.returncode, checked.stderr), (0, ""))
        for words, wanted in ((["conv"], ["convert"]), (["convert", "--sl"], ["--slabs"]),
                              (["convert", "--mode", ""], ["certified", "tolerant"]), (["convert", "--slabs", ""], []),
                              (["batch", "--mode", ""], ["certified", "tolerant"]), (["batch", "--unit", "c"], ["cm"]),
                              (["batch", "-o", "/et"], ["/etc"]),
                              (["completion", "f"], ["fish"]), (["help", "fl"], ["flags"]),
                              (["render", "--matcap", "r"], ["red\\ wax"])):
            line = " ".join(shlex.quote(word) for word in ["relief", *words])
            run = subprocess.run(["bash", "--norc", "-c", f"source {self.folder}/completion.bash; COMP_WORDS=({line}); "
                                  f"COMP_CWORD={len(words)}; _relief 2>/dev/null; printf '%s\\n' \"${{COMPREPLY[@]}}\""],
                                 capture_output=True, text=True, check=True)
            self.assertEqual(run.stdout.split("\n")[:-1], wanted or [""], words)


class Refusals(Case):
    def one_line(self, run, status):
        self.assertEqual(run.status, status, run.err)
        self.assertEqual(run.err.count("\n"), 1, run.err)
        self.assertLessEqual(len(run.err.encode()), 500)
        return run.err.removeprefix("relief: ").rstrip("\n")

    def test_the_nearest_word_is_named(self):
        for args, said in ((["convrt"], "convrt: no such command; the nearest is convert; see relief --help"),
                           (["convert", self.scan, "-o", "x.relief", "--slab", "9"],
                            "--slab: no such option; the nearest is --slabs; see relief convert --help"),
                           (["convert", self.scan, "-o", "x.relief", "--smaples=9"],
                            "--smaples: no such option; the nearest is --samples; see relief convert --help"),
                           (["convert", self.scan, "-o", "x.relief", "--mode", "tolerent"],
                            '--mode: "tolerent" is none of certified, tolerant; the nearest is tolerant; '
                            "see relief convert --help"),
                           (["touch", self.model, "--zzz"], "--zzz: no such option; see relief touch --help")):
            self.assertEqual(self.one_line(Run(*args), 2), said)
        self.assertEqual(self.one_line(Run("help", "flag"), 2),
                         "help: there is no command or topic flag; the nearest is flags; see relief help --help")

    def test_one_wording_for_each_kind(self):
        convert = ["convert", self.scan, "-o", "x.relief"]
        for args, said in (([*convert, "--slabs", "2"], "--slabs: 2 is not in 4 to 1000000"),
                           ([*convert, "--error", "2"], "--error: 2 is not in 1e-7 to 1"),
                           ([*convert, "--slabs", "4.5"], '--slabs: "4.5" is not a whole number (4 to 1000000)'),
                           (["touch", self.model, "--stiffness", "much"],
                            '--stiffness: "much" is not a number (0 to 1000000)'),
                           ([*convert, "--samples", "4", "--error", "0.1"],
                            "--samples and --error exclude each other"),
                           (["convert", self.scan], "-o MODEL.relief is missing"), (["convert"], "MESH is missing"),
                           (["info", self.model, "--salvage"], "--salvage needs --output"),
                           (["convert", self.scan, "-o"], "--output: a value is missing"),
                           (["info", self.model, self.model], f"{self.model}: one argument too many")):
            run = Run(*args)
            self.assertTrue(self.one_line(run, 2).startswith(said + "; see relief "), run.err)

    def test_a_missing_file_and_a_folder_are_said_in_one_way(self):
        def uses(name, extension):
            file = self.folder / (name + extension)
            model, picture, table = (self.folder / ("x" + end) for end in (".relief", ".png", ".csv"))
            return {".ply": [["convert", file, "-o", model], ["render", file, "-o", picture, "--debug", "skin"],
                             ["verify", self.model, "--source", file]],
                    ".relief": [["info", file], ["verify", file], ["undo", file], ["export", file, table.with_suffix(".ply")],
                                ["render", file, "-o", picture], ["refine", file, "-o", model],
                                ["touch", file, "--device", "sim:hand", "--seconds", 1]],
                    ".csv": [["touch", self.model, "--path", file, "-o", table]],
                    ".json": [["sculpt", self.model, "--strokes", file, "-o", model],
                              ["touch", self.model, "--device", f"sim:hand:{file}", "--seconds", 1]],
                    ".rlog": [["replay", file]]}[extension], file

        for extension in (".ply", ".relief", ".csv", ".json", ".rlog"):
            (self.folder / ("folder" + extension)).mkdir(exist_ok=True)
            for name, what in (("gone", "no such file"), ("folder", "is a folder")):
                all_uses, file = uses(name, extension)
                for args in all_uses:
                    said = self.one_line(Run(*args), 1)
                    self.assertEqual(said.removeprefix("sim:hand:"), f"{file}: {what}", args)

    def test_a_model_is_never_written_under_another_name(self):
        gone = self.folder / "gone.ply"  # that nothing is read first
        for args in (["convert", gone, "-o", self.folder / "out.obj"],
                     ["convert", gone, "-o", self.folder / "out.obj", "--force"],
                     ["refine", self.model, "-o", self.folder / "out.obj"],
                     ["info", self.model, "--salvage", "-o", self.folder / "out.obj"]):
            said = self.one_line(Run(*args), 2)
            self.assertEqual(said, f"{self.folder}/out.obj: a model needs a name that ends in .relief; use out.relief; "
                                   f"see relief {args[0]} --help")
        strokes = self.folder / "s.json"
        strokes.write_text('[{"tool": "carve", "radius": 1, "points": [[0, 0, 0, 0, 1]]}]')
        self.one_line(Run("sculpt", self.model, "--strokes", strokes, "-o", self.folder / "out.obj"), 2)
        self.assertFalse((self.folder / "out.obj").exists())
        said = self.one_line(Run("sample", "torus", "-o", self.folder / "link.relief"), 2)
        self.assertIn("does not end in one of .ply", said)
        path = self.folder / "path.csv"
        path.write_text("t,x,y,z\n0,0,0,0\n")
        said = self.one_line(Run("touch", self.model, "--path", path, "-o", self.folder / "force.relief"), 2)
        self.assertEqual(said, f"{self.folder}/force.relief: forces need a name that does not end in .relief; use force.csv; "
                               "see relief touch --help")
        said = self.one_line(Run("sculpt", self.model, "--strokes", path, "-o", self.folder / "x.relief"), 1)
        self.assertEqual(said, f"{path}: line 1, column 2: not JSON; --strokes takes a strokes file (relief help strokes)")

    def test_json_says_what_failed(self):
        gone = self.folder / "gone.ply"
        damaged = self.folder / "damaged.relief"
        damaged.write_text("not a model")
        for args, status, code, file in (
                (["convert", gone, "-o", self.folder / "x.relief"], 1, "NotFound", str(gone)),
                (["convert", self.scan, "-o", self.folder / "x.obj"], 2, "Usage", str(self.folder / "x.obj")),
                (["verify", damaged], 1, "UnsupportedFormat", str(damaged)), (["undo", self.model], 1, "NotFound", str(self.model)),
                (["convert", self.scan], 2, "Usage", None), (["info", self.model, "--nonsense"], 2, "Usage", None)):
            run = Run(*args, "--json")
            said = self.one_line(run, status)
            self.assertEqual(run.json(), {"error": {"code": code, "message": said, "file": file, "exit_status": status}})

    def test_verify_and_replay_print_one_object_with_the_error_in_it(self):
        run = Run("verify", self.model, "--source", self.scan, "--json")
        if run.status != 0:
            self.assertEqual(run.json()["error"]["exit_status"], 1)
        rec, path = self.folder / "r.rlog", self.folder / "r.csv"
        path.write_text("t,x,y,z\n0,0,90,0\n0.001,0,90,0\n")
        self.assertEqual(Run("touch", self.model, "--path", path, "-o", self.folder / "rf.csv", "--record", rec).status, 0)
        whole = Run("replay", rec, "--verify", "--json")
        self.assertEqual(whole.status, 0)
        self.assertNotIn("error", whole.json())


class Telling(Case):
    def test_quiet_leaves_errors_only(self):
        out = self.folder / "quiet.relief"
        for args in (["convert", self.scan, "-o", out], ["info", out], ["verify", out], ["devices"],
                     ["render", out, "-o", self.folder / "q.png", "--size", "64x64"], ["export", out, self.folder / "q.ply"],
                     ["refine", out, "-o", self.folder / "q.relief"], ["sample", "torus", "-o", self.folder / "q.obj"]):
            run = Run(*args, "--quiet")
            self.assertEqual((run.status, run.out, run.err), (0, "", ""), args)
        self.assertIn("no such file", Run("info", self.folder / "gone.relief", "--quiet").err)
        self.assertEqual(Run("info", out, "--quiet", "--json").json()["slabs"], Run("info", out, "--json").json()["slabs"])

    def test_progress_is_a_line_per_phase_and_grows(self):
        out = self.folder / "progress.relief"
        self.assertEqual(Run("convert", self.scan, "-o", out).err, "")
        run = Run("convert", self.scan, "-o", out, "--progress")  # over a model without strokes, which is read first
        lines = run.err.splitlines()
        self.assertGreaterEqual(len(lines), 4, run.err)
        shares = []
        for line in lines:
            self.assertRegex(line, r"^relief: convert: [a-z ]+ \d+ %(, about \d+ (s|min) left)?$")
            shares.append(int(re.search(r"(\d+) %", line)[1]))
        self.assertEqual(shares, sorted(shares))
        self.assertEqual(shares[0], 0)
        self.assertGreater(shares[-1], 50)
        self.assertIn("relief: convert: reading 0 %", lines[0])
        self.assertIn("sampling", run.err)

    def test_a_terminal_gets_one_line_that_is_written_over(self):
        text = on_terminal("convert", self.scan, "-o", self.folder / "pty.relief", "--force")
        self.assertIn("convert: reading 0 %", text)
        self.assertNotIn("\n", text)
        self.assertTrue(text.endswith("\r\x1b[K"), repr(text[-40:]))
        shares = [int(s) for s in re.findall(r"(\d+) %", text)]
        self.assertEqual(shares, sorted(shares))
        self.assertEqual(on_terminal("convert", self.scan, "-o", self.folder / "pty.relief", "--force", "--quiet"), "")


class Units(Case):
    def test_inches_work_to_the_end(self):
        model, print_file, scene = (self.folder / name for name in ("in.relief", "in.3mf", "in.glb"))
        self.assertEqual(Run("convert", self.scan, "-o", model, "--unit", "in", "--slabs", 60).status, 0)
        self.assertEqual(Run("info", model, "--json").json()["unit"], "in")
        self.assertRegex(Run("convert", self.scan, "-o", model, "--unit", "in", "--slabs", 60, "--force").out, r"\d in\b")
        for out in (print_file, scene):
            self.assertEqual(Run("export", model, out, "--level", 1).status, 0)
        with zipfile.ZipFile(print_file) as archive:
            self.assertIn(b'unit="inch"', archive.read("3D/3dmodel.model"))
        size = struct.unpack("<I", scene.read_bytes()[12:16])[0]
        nodes = json.loads(scene.read_bytes()[20:20 + size])["nodes"]
        self.assertEqual([n["scale"] for n in nodes if "scale" in n], [[0.0254] * 3])
        again = Run("info", print_file, "--json").json()
        self.assertEqual(again["unit"], "in")
        metres = Run("info", scene, "--json").json()["bounds"]
        for a, b in zip(again["bounds"], metres):
            for x, y in zip(a, b):
                self.assertAlmostEqual(x * 0.0254, y, delta=1e-5)

    def test_up_turns_the_output(self):
        def bounds(*options):
            out = self.folder / "up.ply"
            self.assertEqual(Run("export", self.model, out, *options).status, 0)
            return Run("info", out, "--json").json()["bounds"]

        (x0, y0, z0), (x1, y1, z1) = bounds()
        self.assertNotAlmostEqual(y1 - y0, z1 - z0, delta=0.1 * (z1 - z0), msg="the torus lies flat")
        for axis, wanted in (("z", ([x0, -z1, y0], [x1, -z0, y1])), ("y", ([x0, z0, -y1], [x1, z1, -y0]))):
            for got, want in zip(bounds("--up", axis), wanted):
                for a, b in zip(got, want):
                    self.assertAlmostEqual(a, b, delta=1e-4 * (x1 - x0))
        refused = Run("export", self.model, self.folder / "up.slabs", "--up", "z")
        self.assertEqual(refused.status, 2)
        self.assertIn("--up is for meshes", refused.err)


if __name__ == "__main__":
    unittest.main()
