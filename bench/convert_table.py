#!/usr/bin/env python3
"""Converts a set of models and writes what that took and gave as a table, in JSON and Markdown.

  bench/convert_table.py [FOLDER ...] [--bin PROGRAM] [--out FOLDER] [--only NAME ...] [--samples n | --per-slab] [--triangles N] [--remesh]
  bench/convert_table.py FOLDER ... --every [--bin PROGRAM] [--out FOLDER]

Models are Relief's own samples and, with FOLDER, the scans below that are found in it or below it by name; the large ones
are made from others by cutting triangles and adding relief, noise or holes, or from volumes. Each is converted with the whole command in a process of its own, to a model and a mended source, and `relief verify --source` then judges
these two files. CPU seconds are user and system time of that process over all its threads; memory is its peak resident set.
What must hold (of all a certificate, but for parts that lie in each other, and memory; of some slabs, distances at n = 63 and CPU
seconds, of large ones 30 for each 1.1 million triangles) is judged, too.
With --before PROGRAM, an older program converts each model first, in the same run, and the table has both: mode, slabs, hash of the
content, distances, CPU seconds and memory. --json prints all of it, with the goals, in place of the table.
With --every, all files of the folders are converted, whatever they are, with the command's own N and n: each must become a model that
holds or be refused with one sentence, within 30 CPU seconds and 2 GiB. The JSON holds these goals and how many files miss one.
Scans of the list that no folder holds have no row; a sentence below the table names them.
Exit status: 0 when every model was converted (with --every, or refused) and holds, 1 when one was not or breaks a must (its row says why), 2 wrong usage.
"""

import argparse
import json
import os
import pathlib
import platform
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Scans by name, and the slabs to aim for.
SCANS = {
    "bunny": 150, "igea": 200, "nefertiti": 400, "armadillo": 200, "horse": 200, "max_planck_20k": 200, "head_lps": 200,
    "skull": 200, "lion_statue": 200, "pumpkin": 200, "visible_human_skin": 200, "brain_cortex_mni": 200, "fertility": 200,
    "elephant_refined": 200, "dragon": 200, "ogre": 200, "beast": 200, "happy_buddha": 200, "tower_holes": 200,
    "bone_nose_ct": 200, "igea_1m_noisy": 240, "bunny_1m": 200, "bunny_1m_scan": 200, "head_1m": 200, "ct_skull_2m": 2000,
    "mri_head_3m": 2000, "dragon_3m": 2000, "mri_brain_6m": 2000, "pumpkin_8m": 400, "igea_17m": 400,
    # Solids whose parts overlap, nest or lie near each other, and sources that close nothing off.
    "jaw_teeth": 200, "pumpkin_quads": 200, "bool_coplanar_overlap": 200, "box1": 200, "cup_0.01": 200, "hair_cards": 200,
    "klein": 200, "outlier_tri": 200, "overlapping_two": 200, "plate_box": 200, "sunk_8": 200, "text_bars": 200,
    "thin_hollow_0.01": 200,
}
OWN = {"pumpkin": 200, "head": 200, "torus": 200, "bowl": 200}
# What must hold: slabs (none: no bound), CPU seconds, and rms there and back at n = 63.
MUSTS = {
    "bunny": (150, 3, 1.2e-4), "igea": (200, 6, 3e-5), "nefertiti": (400, 4, None), "dragon": (None, 40, None),
    "igea_1m_noisy": (240, None, None),
}
# CPU seconds for each triangle of large ones.
LARGE = {"igea_1m_noisy", "bunny_1m", "bunny_1m_scan", "head_1m", "dragon_3m", "pumpkin_8m", "igea_17m"}
EACH = 30 / 1_100_000
# Sheets that close nothing off, or run through each other; and what mending has to move by more than 1 % of the diagonal.
UNCERTIFIED = {"bone_nose_ct", "hair_cards", "klein"}
MEMORY = (64 * 2**20, 300)  # bytes at most, and per triangle of the source
EVERY = (30, 2048)  # CPU seconds and MiB at most, of any file
MESHES = (".ply", ".obj", ".stl", ".off", ".gltf", ".glb", ".3mf")


class Run:
    """One command in a process of its own, and what it used."""

    def __init__(self, command, limit):
        started = time.monotonic()
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=err)
            timer = threading.Timer(limit, child.kill)
            timer.start()
            _, state, usage = os.wait4(child.pid, 0)
            timer.cancel()
            child.returncode = os.waitstatus_to_exitcode(state)
            out.seek(0), err.seek(0)
            self.out, self.err = out.read().decode(), err.read().decode("utf-8", "replace").strip()
        self.status = child.returncode
        self.wall = time.monotonic() - started
        self.cpu = usage.ru_utime + usage.ru_stime
        self.mib = usage.ru_maxrss / 1024
        if self.status == -signal.SIGKILL and self.wall >= limit:
            self.err = f"stopped after {limit:g} s"

    def json(self):
        try:
            return json.loads(self.out)
        except ValueError:
            return {}


def find_scans(folders):
    """(name, file) of the scans that are there; of several with one name the first by folder and path."""
    found = {}
    for folder in folders:
        for file in sorted(folder.rglob("*")):
            if file.suffix.lower() in MESHES and file.stem in SCANS:
                found.setdefault(file.stem, file)
    return [(name, found[name]) for name in SCANS if name in found]


def is_refusal(row):
    """One line that begins with the program's name and holds one sentence."""
    text = row.get("error", "")
    return row["status"] == 1 and text.startswith("relief: ") and "\n" not in text and not re.search(r"[.!?] +[A-Z]", text)


def broken_musts(name, row, options):
    """Sentences, one for each must that the row of a model breaks."""
    said = []

    def must(holds, what):
        if not holds:
            said.append(what)
    if options.every:
        must(row["status"] == 0 or is_refusal(row), f"neither converted nor refused with one sentence, exit status {row['status']}")
        must(row.get("verified", True), "converted, but verify does not confirm what the mode claims")
        must(row["cpu_s"] <= EVERY[0], f"{row['cpu_s']:.2f} CPU s, must be {EVERY[0]} at most")
        must(row["peak_mib"] <= EVERY[1], f"{row['peak_mib']:.0f} MiB, must be {EVERY[1]} at most")
        return said
    if options.remesh or "convert" not in row:
        return []
    c, (slabs, seconds, rms) = row["convert"], MUSTS.get(name, (None, None, None))
    if name in LARGE:
        seconds = row["triangles"] * EACH
    if slabs is not None:
        must(c["slabs"] <= slabs, f"{c['slabs']} slabs, must be {slabs} at most")
    if name not in UNCERTIFIED:
        must(c["mode"] == "certified", f"{c['mode']} mode, must be certified")
        missing = (1 - c["coverage"]["visible_share"]) * c["fibres_cast"]
        must(c["hits"]["none"] <= missing + 1 and c["hits"]["several"] == 0, "fibres that meet the source not exactly once")
    if rms is not None and options.samples == 63 and not options.per_slab:
        worst = max(c["distance"][way]["rms"] for way in ("to_mended", "from_mended"))
        must(worst <= rms, f"rms {worst:.2e}, must be {rms:.1e} at most")
    if seconds is not None:
        must(row["cpu_s"] <= seconds, f"{row['cpu_s']:.2f} CPU s, must be {seconds:.3g} at most")
    most = (MEMORY[0] + MEMORY[1] * row["triangles"]) / 2**20
    must(row["peak_mib"] <= most, f"{row['peak_mib']:.0f} MiB, must be {most:.0f} at most")
    return said


def resolution(options):
    """Arguments for an n that is the same in all slabs, or none: then convert chooses one for each slab."""
    return [] if options.every or options.per_slab else ["--samples", str(options.samples)]


def content_hash(relief, model, options):
    return Run([relief, "info", str(model), "--json"], options.limit).json().get("content_hash")


def goals_of(name, row):
    """What must hold of a model, beside its figures."""
    slabs, seconds, rms = MUSTS.get(name, (None, None, None))
    if name in LARGE:
        seconds = row["triangles"] * EACH
    mode = None if name in UNCERTIFIED else "certified"
    return {"mode": mode, "slabs": slabs, "cpu_s": seconds, "rms_at_63": rms,
            "peak_mib": round((MEMORY[0] + MEMORY[1] * row["triangles"]) / 2**20, 1)}


def row_of(relief, name, file, slabs, options, work):
    model, mended = work / "model.relief", work / "mended.ply"
    command = [relief, "convert", str(file), "-o", str(model), "--mended", str(mended), "--slabs", str(slabs), "--force", "--json"]
    command += resolution(options)
    if options.remesh:
        command.append("--remesh")
    made = Run(command, options.limit)
    row = {"model": name, "file_bytes": file.stat().st_size, "target": slabs, "status": made.status,
           "cpu_s": round(made.cpu, 3), "wall_s": round(made.wall, 3), "peak_mib": round(made.mib, 1)}
    if made.status != 0:
        row["error"] = made.err
    else:
        convert = made.json()
        triangles = convert["source_triangles"]
        row |= {"triangles": triangles, "bytes_per_triangle": round((made.mib - 64) * 2**20 / triangles, 1), "convert": convert}
        judged = Run([relief, "verify", str(model), "--source", str(mended), "--json"], options.limit)
        row |= {"content_hash": content_hash(relief, model, options), "goals": None if options.every else goals_of(name, row)}
        row |= {"verified": judged.status == 0, "verify_cpu_s": round(judged.cpu, 3), "verify": judged.json()}
        if judged.status != 0:
            row["error"] = judged.err
    row["broken_musts"] = broken_musts(name, row, options)
    return row


def before_of(relief, file, slabs, options, work):
    """What an older program made of the same file, in the same run."""
    model, mended = work / "before.relief", work / "before.ply"
    command = [relief, "convert", str(file), "-o", str(model), "--mended", str(mended), "--slabs", str(slabs), "--force", "--json"]
    command += resolution(options) + (["--remesh"] if options.remesh else [])
    made = Run(command, options.limit)
    row = {"status": made.status, "cpu_s": round(made.cpu, 3), "peak_mib": round(made.mib, 1)}
    if made.status != 0:
        return row | {"error": made.err}
    convert = made.json()
    judged = Run([relief, "verify", str(model), "--source", str(mended), "--json"], options.limit)
    return row | {"mode": convert.get("mode"), "slabs": convert.get("slabs"), "hits": convert.get("hits"),
                  "verdict": convert.get("verdict"), "distance": convert.get("distance"),
                  "content_hash": content_hash(relief, model, options), "verified": judged.status == 0}


def changes_of(row):
    """How a model's figures compare with those of the older program: ratios of after to before. None: the older program did not say."""
    before, after = row["before"], row.get("convert")
    if before["status"] != 0 or after is None:
        return None

    def ratio(now, then):
        return round(now / then, 3) if then else None
    back = [((report["distance"] or {}).get("from_mended") or {}).get("max") for report in (after, before)]
    same = row["content_hash"] == before["content_hash"] if before["content_hash"] else None
    return {"same_content": same, "cpu": ratio(row["cpu_s"], before["cpu_s"]),
            "memory": ratio(row["peak_mib"], before["peak_mib"]), "slabs": ratio(after["slabs"], before["slabs"]),
            "greatest": ratio(*back)}


def single_share(hits):
    """Of the fibres that were cast, those that meet the source once, in percent."""
    return 100 * hits["single"] / max(1, sum(v for v in hits.values() if isinstance(v, int)))


def said_before(row):
    """The older program's outcome, for the table."""
    before = row["before"]
    if before["status"] != 0:
        return f"none, {before['cpu_s']:.2f} s"
    slabs = "unknown" if before["slabs"] is None else f"{before['slabs']:,}"
    hits = before["hits"]
    single = f"{single_share(hits):.2f} %" if hits else "unknown"
    return f"{before['mode'] or 'unknown'}, {slabs}, {single}, {before['cpu_s']:.2f} s, {before['peak_mib']:.0f} MiB"


def markdown(rows, options):
    text = [
        f"n = {'chosen per slab' if options.every or options.per_slab else options.samples}{', remeshed' if options.remesh else ''}. CPU: seconds of the whole command over all its threads;"
        " memory: its peak resident set, and the bytes per triangle of it beyond 64 MiB. Single: fibres that meet the mended source exactly once. Distances between the displaced"
        " surface and the mended source, there and back, shares of the diagonal. Verified: `relief verify --source` on the model and the mended"
        " source says that all that the mode claims holds. Covered: the share of the source's visible area that the model has.", "",
        "| model | triangles | slabs (asked) | mode | CPU s | wall s | MiB | B/triangle | single | rms there, back | greatest there, back | covered | verified |"
        + (" before: mode, slabs, single, CPU, memory |" if options.before else ""),
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|" + ("---|" if options.before else "")]
    reasons = []
    for row in rows:
        head, c = f"| {row['model']} |", row.get("convert")
        tail = f" {said_before(row)} |" if options.before else ""
        if c is None:
            text.append(f"{head} | ({row['target']}) | none | {row['cpu_s']:.2f} | {row['wall_s']:.2f} | {row['peak_mib']:.0f} | | | | | |"
                        f" |{tail}")
        else:
            hits, there, back = c["hits"], c["distance"]["to_mended"], c["distance"]["from_mended"]
            single = single_share(hits)
            text.append(f"{head} {row['triangles']:,} | {c['slabs']:,} ({row['target']}) | {c['mode']} | {row['cpu_s']:.2f} |"
                        f" {row['wall_s']:.2f} | {row['peak_mib']:.0f} | {max(0, row['bytes_per_triangle']):.0f} | {single:.2f} % | {there['rms']:.1e}, {back['rms']:.1e} |"
                        f" {there['max']:.1e}, {back['max']:.1e} | {100 * c['coverage']['visible_share']:.2f} % | {'yes' if row['verified'] else 'no'} |{tail}")
            if c["mode"] != "certified":
                reasons.append(f"- {row['model']}: {c['verdict']}")
            if "not_certified" in c:
                reasons.append(f"- {row['model']} is not certified: {c['not_certified']}")
        if "error" in row:
            reasons.append(f"- {row['model']}: {row['error']}")
        reasons += [f"- {row['model']} breaks a must: {what}" for what in row["broken_musts"]]
    return "\n".join(text + ([""] + reasons if reasons else [])) + "\n"


def said_skipped(skipped, folders):
    """A sentence on the scans of the list that have no row; none where all have one."""
    if not skipped:
        return ""
    where = f"not in {', '.join(map(str, folders))}" if folders else "as no folder of scans was given"
    return f"Skipped, {where}: {', '.join(skipped)}."


def write(rows, skipped, options):
    machine = {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count(),
               "load": [round(x, 1) for x in os.getloadavg()]}
    options.out.mkdir(parents=True, exist_ok=True)
    kept = {"machine": machine, "rows": rows, "skipped": skipped}
    if options.every:
        kept |= {"goals": {"cpu_s": EVERY[0], "peak_mib": EVERY[1]}, "missed": sum(1 for row in rows if row["broken_musts"])}
    table = json.dumps(kept, indent=1) + "\n"
    said = said_skipped(skipped, options.folders)
    text = markdown(rows, options) + (f"\n{said}\n" if said else "")
    (options.out / "table.json").write_text(table, encoding="utf-8")
    (options.out / "table.md").write_text(text, encoding="utf-8")
    return table, text


def models_of(options, parser):
    """(name, file or None for a sample of Relief's own, slabs) of what the options ask for, and the names of scans that are not there."""
    if options.every:
        if options.only or options.remesh or not options.folders:
            parser.error("--every takes folders and neither --only nor --remesh")
        files = [(str(file.relative_to(folder.parent)), file, 200)
                 for folder in map(pathlib.Path.resolve, options.folders) for file in sorted(folder.rglob("*")) if file.is_file()]
        if not files:
            parser.error(f"{', '.join(map(str, options.folders))} holds no file")
        return files, []
    known = set(SCANS) | set(OWN)
    if unknown := set(options.only or []) - known:
        parser.error(f"{', '.join(sorted(unknown))}: there are {', '.join(sorted(known))}")
    wanted = options.only or known
    scans = [(name, file) for name, file in find_scans(options.folders) if name in wanted]
    if options.folders and not scans:
        parser.error(f"{', '.join(map(str, options.folders))} holds no scan with a known name: {', '.join(n for n in SCANS if n in wanted)}")
    there = {name for name, _ in scans}
    skipped = [name for name in SCANS if name in wanted and name not in there and name not in OWN]
    return ([(name, None, slabs) for name, slabs in OWN.items() if name in wanted] +
            [(name, file, SCANS[name]) for name, file in scans]), skipped


def holds(row, options):
    refused = options.every and "convert" not in row
    return not row["broken_musts"] and (refused or row.get("verified", False))


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", metavar="FOLDER", nargs="*", type=pathlib.Path, help="where scans lie")
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin/relief", help="the program to measure")
    parser.add_argument("--before", type=pathlib.Path, metavar="PROGRAM", help="an older program that converts each, too")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out", help="folder for table.json and table.md")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these models only")
    parser.add_argument("--samples", type=int, default=63, metavar="n", help="intervals per slab edge (default 63)")
    parser.add_argument("--per-slab", action="store_true", help="an n for each slab, as convert chooses it by default")
    parser.add_argument("--triangles", type=int, default=100_000, help="of Relief's own samples (default 100000)")
    parser.add_argument("--remesh", action="store_true", help="remesh every model")
    parser.add_argument("--every", action="store_true", help="every file of the folders, as a user would convert it")
    parser.add_argument("--json", action="store_true", help="print the rows as JSON in place of the table")
    parser.add_argument("--limit", type=float, default=600, help="seconds that one command may take (default 600)")
    options = parser.parse_args(arguments)
    relief = str(options.bin.resolve())
    if not os.access(relief, os.X_OK):
        parser.error(f"{relief} is not there; build it with ./dev build")
    for folder in options.folders:
        if not folder.is_dir():
            parser.error(f"{folder} is no folder")
    models, skipped = models_of(options, parser)
    rows, table, text = [], "", ""
    with tempfile.TemporaryDirectory(prefix="relief-table-") as folder:
        work = pathlib.Path(folder)
        for name, file, slabs in models:
            if file is None:
                file = work / f"{name}.ply"
                sample = Run([relief, "sample", name, "-o", str(file), "--triangles", str(options.triangles)], options.limit)
                if sample.status != 0:
                    sys.exit(sample.err)
                name = f"{name} (sample)"
            before = before_of(str(options.before.resolve()), file, slabs, options, work) if options.before else None
            rows.append(row_of(relief, name, file, slabs, options, work))
            if before:
                rows[-1]["before"] = before
                rows[-1]["changes"] = changes_of(rows[-1])
            table, text = write(rows, skipped, options)
            if sys.stderr.isatty():
                print(f"{name}: {rows[-1]['cpu_s']:.2f} CPU s", file=sys.stderr)
    print(table if options.json else text, end="")
    return 0 if all(holds(row, options) for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
