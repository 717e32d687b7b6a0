#!/usr/bin/env python3
"""Runs the benchmarks and the acceptance tests, and keeps what they measured in bench/results/.

  bench/results.py [PART ...] [--scans FOLDER [--only NAME ...]] [--files FOLDER ...] [--runs N] [--out FOLDER] [--bin FOLDER]

PART is one of query, touch, dab, clay, render, paper, convert, safety; without one, all of them. --scans FOLDER adds the parts scans and
scans-63, conversions of the known scans of a folder, which take half an hour each; --files FOLDER ... adds the part files, a conversion
of every file of the folders. Each part becomes one file, PART-MACHINE-DATE.json, which
replaces the older ones of the same part and machine. With --runs N each number is the median of N runs.

A file is one object: bench, machine, cpu, cores, memory_gib, load (threads that ran or waited, before and after), date, commit,
command, runs and rows, one row per line. tools/result_tables.py makes the tables of docs/evidence/ of them.
"""

import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

import convert_table

ROOT = pathlib.Path(__file__).resolve().parent.parent
PERCENTILES = ("p50", "p90", "p99", "p999", "max")
WAYS = ("slide", "tap", "press", "jump")


def spread(percentiles, scale=1.0):
    """p50 to max of what a program says, times `scale`."""
    return {key: percentiles[key] * scale for key in PERCENTILES if key in percentiles}


def figure_rows(said):
    """Rows of figures, which touch, dab, clay and render share: what, on what, how much, the target, the spread."""
    for f in said["figures"]:
        row = {"figure": f["name"], "on": f["surface"], "value": f["value"], "unit": f["unit"], "clock": f["clock"]}
        yield row | f.get("goal", {}) | spread(f.get("percentiles", {})) | f.get("more", {})


def touch_rows(said):
    yield from figure_rows(said)
    for on, beside in said["same_surface"].items():
        for peer, of in beside.get("rows", {}).items():
            common = {"peer": peer, "on": on, "triangles": beside["triangles"]}
            for way in WAYS:
                yield common | {"way": way, "unit": "us", "clock": "thread CPU"} | spread(of["warm_ns"][way], 1e-3)
            if "cold_ns" in of:
                yield common | {"way": "caches evicted", "unit": "us", "clock": "thread CPU"} | spread(of["cold_ns"], 1e-3)
            row = common | {"bytes_per_triangle": of["bytes_per_triangle"], "build_cpu_s": of["build_cpu_seconds"]}
            if slide := of.get("accuracy", {}).get("slide"):
                distance, normal = slide["distance_error_of_diagonal"], slide["normal_degrees"]
                row |= {"distance_p50": distance["p50"], "distance_p99": distance["p99"], "degrees_p50": normal["p50"],
                        "degrees_p99": normal["p99"], "places": slide["places"], "wrong_side": slide["wrong_side"],
                        "without_answer": slide["without_answer"]}
            yield row
    for at in said["growth"]:
        for what in ("locate", "probe"):
            yield {"query": what, "slabs": at["slabs"], "unit": "ns", "clock": "thread CPU"} | spread(at[f"{what}_ns"])


def query_rows(said):
    names = {"locate_ns": "locate, tracked", "probe_with_normal_ns": "probe with normal, tracked",
             "locate_from_nothing_ns": "locate from nothing", "paper_in_sequence_ns": "the paper's algorithm"}
    for key, name in names.items():
        yield {"query": name, "on": said["model"], "unit": "ns", "clock": "thread CPU"} | spread(said[key])


def paper_rows(said):
    for model, of in said.items():
        for what, key, unit in (("slabs", "slabs", ""), ("polygons per slab", "polygons_per_slab", ""), ("triangles", "triangles", ""),
                                ("conversion", "convert_cpu_seconds", "s"), ("dabs per second", "dabs_per_second", ""),
                                ("samples edited per second", "edits_per_second", "")):
            yield {"what": what, "model": model, "value": of[key], "unit": unit, "clock": "process CPU" if unit else "thread CPU"}
        yield {"what": "haptic iteration", "model": model, "unit": "us", "clock": "thread CPU"} | spread(of["iteration_ns"], 1e-3)
        yield {"what": "frame", "model": model, "unit": "ms", "clock": "process CPU"} | spread(of["frame"]["cpu_ms"])
        yield {"what": "frame", "model": model, "unit": "ms", "clock": "wall"} | spread(of["frame"]["wall_ms"])


def conversion_rows(table, resolution):
    for row in table["rows"]:
        made = row.get("convert")
        if made is None:
            yield {"model": row["model"], "n": resolution, "asked": row["target"], "mode": "refused", "cpu_s": row["cpu_s"],
                   "wall_s": row["wall_s"], "peak_mib": row["peak_mib"]}
            continue
        hits, there, back = made["hits"], made["distance"]["to_mended"], made["distance"]["from_mended"]
        cast = sum(count for count in hits.values() if isinstance(count, int))
        yield {"model": row["model"], "n": resolution, "triangles": row["triangles"], "slabs": made["slabs"], "asked": row["target"],
               "mode": made["mode"], "cpu_s": row["cpu_s"], "wall_s": row["wall_s"], "peak_mib": row["peak_mib"],
               "single_share": hits["single"] / max(1, cast), "rms": [there["rms"], back["rms"]], "most": [there["max"], back["max"]],
               "covered_share": made["coverage"]["visible_share"], "verified": row["verified"]}


def without_content(sentence):
    """A refusal without the words of the file that it quotes."""
    return re.sub(r"'[^']*'(?= is not a number)|(?<=but there is )'[^']*'", "'...'", sentence)


def file_rows(table):
    """A row per file: what became of it and the sentence that says so. Before these, what must hold of all of them."""
    rows, goals = table["rows"], table["goals"]
    converted = [row for row in rows if "convert" in row]
    slowest, largest = (max(rows, key=lambda row: row[key]) for key in ("cpu_s", "peak_mib"))
    yield {"figure": "files that miss a goal", "value": table["missed"], "unit": "", "at_most": 0, "of": len(rows)}
    yield {"figure": "neither converted nor refused with one sentence", "unit": "", "at_most": 0, "of": len(rows),
           "value": sum(1 for row in rows if row["status"] != 0 and not convert_table.is_refusal(row))}
    yield {"figure": "models that verify does not confirm", "unit": "", "at_most": 0, "of": len(converted),
           "value": sum(1 for row in converted if not row["verified"])}
    yield {"figure": "CPU seconds, the slowest file", "value": slowest["cpu_s"], "unit": "s", "at_most": goals["cpu_s"], "of": len(rows),
           "file": slowest["model"], "p50": statistics.median(row["cpu_s"] for row in rows)}
    yield {"figure": "memory, the largest file", "value": largest["peak_mib"], "unit": "MiB", "at_most": goals["peak_mib"], "of": len(rows),
           "file": largest["model"], "p50": statistics.median(row["peak_mib"] for row in rows)}
    for row in rows:
        kept = {"file": row["model"], "cpu_s": row["cpu_s"], "wall_s": row["wall_s"], "peak_mib": row["peak_mib"], "missed": row["broken_musts"]}
        made = row.get("convert")
        if made is None:
            yield kept | {"outcome": "refused", "said": without_content(row["error"].split(f"{row['model']}: ", 1)[-1].removeprefix("relief: "))}
            continue
        yield kept | {"outcome": made["mode"], "said": made["verdict"], "verify_said": row["verify"].get("verdict", row.get("error")),
                      "triangles": row["triangles"], "slabs": made["slabs"], "covered_share": made["coverage"]["visible_share"],
                      "bound": max(made["distance"]["to_source"]["max"], made["coverage"]["farthest"]), "verified": row["verified"]}


class Bench:
    """Where the programs are, and how each part is run."""

    def __init__(self, programs, scans, only, files):
        self.programs, self.scans, self.only, self.files = programs, scans, only, files

    def json_of(self, part):
        text = self.run([self.programs / "relief-bench", part, "--json"], (0,)).stdout
        return json.loads(text)[part]

    def run(self, command, good):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode not in good:
            sys.exit(f"results: {pathlib.Path(command[0]).name}: exit status {done.returncode}: {(done.stderr or done.stdout).strip()[-300:]}")
        return done

    def table(self, *arguments):
        """Rows of bench/convert_table.py. Status 1 is a row that breaks a bound: it is kept like the others."""
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, ROOT / "bench/convert_table.py", "--bin", self.programs / "relief", "--out", folder, *arguments]
            self.run(command, (0, 1))
            return json.loads((pathlib.Path(folder) / "table.json").read_text())

    def convert(self):
        return [*conversion_rows(self.table("--per-slab"), "per slab"), *conversion_rows(self.table(), 63)]

    def of_scans(self, resolution, *arguments):
        only = ["--only", *self.only] if self.only else []
        rows = conversion_rows(self.table(self.scans, *only, *arguments), resolution)
        return [row for row in rows if not row["model"].endswith("(sample)")]

    def safety(self):
        """The rows of all acceptance tests, each in a process of its own, as many at a time as there are cores."""
        def rows_of(test):
            file = pathlib.Path(folder) / f"{test}.json"
            self.run([self.programs / "acceptance", test, "--json", file], (0, 77))
            return json.loads(file.read_text())["rows"]
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as workers:
            return [row for rows in workers.map(rows_of, [f"S{k}" for k in range(1, 24)]) for row in rows]

    def parts(self):
        """Name -> (command as a user types it, function that gives its rows)."""
        said = {"touch": touch_rows, "dab": figure_rows, "clay": figure_rows, "render": figure_rows, "query": query_rows, "paper": paper_rows}
        parts = {name: (f"./dev bench {name} --json", lambda name=name: list(said[name](self.json_of(name)))) for name in said}
        parts["convert"] = ("./dev bench table", self.convert)
        parts["safety"] = ("build/release/bin/acceptance all --json FILE", self.safety)
        if self.scans:
            parts["scans"] = ("./dev bench table SCANS --per-slab", lambda: self.of_scans("per slab", "--per-slab"))
            parts["scans-63"] = ("./dev bench table SCANS", lambda: self.of_scans(63))
        if self.files:
            parts["files"] = ("./dev bench table FOLDER ... --every", lambda: list(file_rows(self.table(*self.files, "--every"))))
        return parts


def middle(values):
    """Runs of the same thing as one: numbers by their median, the rest as the first run has it."""
    first = values[0]
    if isinstance(first, bool) or not isinstance(first, (int, float, list, dict)):
        return first
    if isinstance(first, list):
        if any(len(value) != len(first) for value in values):
            sys.exit("results: the runs have different rows")
        return [middle([value[k] for value in values]) for k in range(len(first))]
    if isinstance(first, dict):
        return {key: middle([value[key] for value in values]) for key in first}
    return statistics.median(values)


def short(value):
    """Four significant digits, which is more than any of these figures is good for."""
    if isinstance(value, float):
        return int(value) if value.is_integer() and abs(value) < 1e15 else float(f"{value:.4g}")
    if isinstance(value, list):
        return [short(each) for each in value]
    if isinstance(value, dict):
        return {key: short(each) for key, each in value.items()}
    return value


def machine():
    """What the system says of the processor; a name of it that files and tables can hold."""
    text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    def of(key):
        found = re.search(rf"^{key}\s*:\s*(.+)$", text, re.M)
        return found[1].strip() if found else "unknown"
    name, family, model = of("model name"), of("cpu family"), of("model")
    slug = re.sub(r"[^a-z0-9]+", "-", f"{name} {family} {model}".lower()).strip("-")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {"machine": slug, "cpu": f"{name}, family {family}, model {model}", "cores": len(os.sched_getaffinity(0)),
            "memory_gib": round(memory)}


def commit():
    done = subprocess.run(["git", "-C", str(ROOT), "describe", "--always", "--dirty"], capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def text_of(result):
    """The object as text, one row per line, so that changes can be read."""
    head = json.dumps({key: value for key, value in result.items() if key != "rows"}, indent=1)
    rows = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in result["rows"])
    return f'{head[:-2]},\n "rows": [\n  {rows}\n ]\n}}\n'


def keep(result, folder):
    """Writes a result in place of the older ones of its part and machine."""
    stem = f"{result['bench']}-{result['machine']}"
    for old in folder.glob(f"{stem}-????-??-??.json"):
        old.unlink()
    file = folder / f"{stem}-{result['date']}.json"
    file.write_text(text_of(result), encoding="utf-8")
    return file


def measure(part, command, rows_of, runs):
    before, rows = os.getloadavg()[0], []
    for _ in range(runs):
        rows.append(rows_of())
    load = [round(before, 1), round(os.getloadavg()[0], 1)]
    return {"bench": part, **machine(), "load": load, "date": datetime.date.today().isoformat(), "commit": commit(),
            "command": command, "runs": runs, "rows": [short(row) for row in middle(rows)]}


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wanted", metavar="PART", nargs="*", help="query, touch, dab, clay, render, paper, convert, safety (default: all)")
    parser.add_argument("--scans", type=pathlib.Path, metavar="FOLDER", help="also convert the known scans of a folder")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="with --scans: these scans only")
    parser.add_argument("--files", type=pathlib.Path, nargs="+", metavar="FOLDER", help="also convert every file of these folders")
    parser.add_argument("--runs", type=int, default=1, metavar="N", help="runs of each part; numbers are medians (default 1)")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "bench/results", help="folder of the results")
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin", help="folder of the programs")
    options = parser.parse_args(arguments)
    parts = Bench(options.bin.resolve(), options.scans and options.scans.resolve(), options.only,
                  [folder.resolve() for folder in options.files or []]).parts()
    for part in options.wanted:
        if part not in parts:
            parser.error(f"{part}: there are {', '.join(parts)}; scans need --scans FOLDER, files --files FOLDER")
    if options.runs < 1:
        parser.error(f"--runs: {options.runs} is less than 1")
    options.out.mkdir(parents=True, exist_ok=True)
    for part in options.wanted or parts:
        command, rows_of = parts[part]
        file = keep(measure(part, command, rows_of, options.runs), options.out)
        print(f"{part}: {file}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
