#!/usr/bin/env python3
"""Writes the measured tables of docs/evidence/ from bench/results/.

  tools/result_tables.py [--write] [ROOT]

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; NAME is one of TABLES below. For each machine the newest
result of the part that NAME needs is shown, under a line that says where, when and how it was measured. Without --write, prints
one line per table that differs from its data. Exit status: 0 pages and data agree, 1 they do not, 2 wrong usage.
"""

import json
import pathlib
import re
import sys

MARK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.S)
MONTHS = "January February March April May June July August September October November December".split()
MISSED = " **missed**"


def load(folder):
    """The newest result of each (part, machine), by part and then machine."""
    newest = {}
    for file in sorted(folder.glob("*.json")):
        result = json.loads(file.read_text(encoding="utf-8"))
        key = (result["bench"], result["machine"])
        if key not in newest or newest[key]["date"] <= result["date"]:
            newest[key] = result
    return [newest[key] for key in sorted(newest)]


def number(value):
    """Three significant digits, as people read them."""
    if isinstance(value, int) or (abs(value) >= 100 and float(value).is_integer()):
        return f"{int(value):,}"
    if abs(value) < 1e-12:  # of rounding alone
        return "0"
    if abs(value) >= 1000:
        return f"{float(f'{value:.3g}'):,.0f}"
    return f"{value:.1e}" if abs(value) < 1e-3 else f"{value:.3g}"


def with_unit(value, unit):
    if unit.startswith("bytes") and value >= 10_000:
        return f"{number(value / 1000)} kB"
    unit = {"us": "µs", "um/min": "µm/min", "times": "×"}.get(unit, unit)
    return f"{number(value)} {unit}".strip()


def at(row, *keys):
    """Some percentiles of a row in one cell; nothing where the row has none."""
    return " / ".join(number(row[key]) for key in keys if key in row)


def target(row):
    """The bound of a figure, and whether it is missed."""
    if "at_most" in row:
        return f"≤ {number(row['at_most'])}" + (MISSED if row["value"] > row["at_most"] else "")
    if "at_least" in row:
        return f"≥ {number(row['at_least'])}" + (MISSED if row["value"] < row["at_least"] else "")
    return ""


def grid(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in rows)]


def day(date):
    year, month, day_of_month = date.split("-")
    return f"{int(day_of_month)} {MONTHS[int(month) - 1]} {year}"


def said_of(result):
    """The line above a table: machine, date, load, commit, command."""
    runs = "1 run" if result["runs"] == 1 else f"medians of {result['runs']} runs"
    load = [f"load {' to '.join(number(x) for x in result['load'])}"] if result["load"] else []
    load = ", ".join(load + ([result["source"]] if "source" in result else []))
    return f"`{result['machine']}`, {day(result['date'])}, {load}, {runs}: `{result['command']}`."


# ---- One function per table: rows of a result to lines of Markdown.

PAPER = {"slabs": "200, 200, 150", "polygons per slab": "225", "triangles": "45,000", "conversion": "by hand in part",
         "haptic iteration": "under 650 µs", "dabs per second": "10", "samples edited per second": "20,000 to 80,000",
         "frame": "100 ms"}


def paper(rows):
    models = list(dict.fromkeys(row["model"] for row in rows))
    lines = {}
    for row in rows:
        if "value" in row:
            lines.setdefault((row["what"], ""), {})[row["model"]] = with_unit(row["value"], row["unit"])
        else:
            clock = "" if row["clock"] == "thread CPU" else f", {row['clock']}"
            lines.setdefault((row["what"], f"{clock}: p50 / p99"), {})[row["model"]] = f"{at(row, 'p50', 'p99')} {with_unit(0, row['unit'])[2:]}"
    return grid(["", "paper", *models], ([what + more, PAPER[what], *(of[m] for m in models)] for (what, more), of in lines.items()))


def queries(rows):
    return grid(["query, ns", "p50", "p90", "p99", "max"],
                ([row["query"], *(at(row, key) for key in ("p50", "p90", "p99", "max"))] for row in rows))


def growth(rows):
    grown = [row for row in rows if "slabs" in row]
    sizes = list(dict.fromkeys(row["slabs"] for row in grown))
    of = {(row["query"], row["slabs"]): at(row, "p50", "p90", "p99") for row in grown}
    return grid(["slabs, ns: p50 / p90 / p99", "locate", "probe"], ([number(s), of["locate", s], of["probe", s]] for s in sizes))


def figures(rows):
    return grid(["figure", "value", "target", "p50", "p90", "p99", "max"],
                ([row["figure"], with_unit(row["value"], row["unit"]) + (" (wall)" if row["clock"] == "wall" else ""), target(row),
                  *(at(row, key) for key in ("p50", "p90", "p99", "max"))] for row in rows))


def touch_figures(rows):
    return figures([row for row in rows if "figure" in row and
                    (row["on"] == "pumpkin, n = 32" or "growth" in row["figure"] or row["unit"] == "bytes")])


def touch_surfaces(rows):
    shown = [row for row in rows if "figure" in row and row["unit"] in ("us", "times") and "," in row["on"]]
    surfaces = [s for s in dict.fromkeys(row["on"] for row in shown) if s != "pumpkin, n = 32"]
    names = [n for n in dict.fromkeys(row["figure"] for row in shown if row["on"] in surfaces)]
    of = {(row["figure"], row["on"]): number(row["value"]) + (MISSED if MISSED in target(row) else "") for row in shown}
    return grid(["figure", *surfaces], ([name, *(of.get((name, s), "") for s in surfaces)] for name in names))


PLAIN = ", plain"  # how the name of a peer ends that does it as its own example does; pages show each at its best


def at_its_best(peer):
    return not peer.endswith(PLAIN)


def peers(surface):
    def table(rows):
        mine = [row for row in rows if row.get("on") == surface and at_its_best(row.get("peer", PLAIN))]
        names = list(dict.fromkeys(row["peer"] for row in mine))
        ways = ["slide", "tap", "press", "jump"]
        spread = {(row["peer"], row["way"]): at(row, "p50", "p99") for row in mine if "way" in row}
        fixed = {row["peer"]: row for row in mine if "bytes_per_triangle" in row}
        return grid([f"{surface}: p50 / p99, µs", *ways, "bytes per triangle", "build, CPU s"],
                    ([name, *(spread[name, way] for way in ways), number(fixed[name]["bytes_per_triangle"]),
                      number(fixed[name]["build_cpu_s"])] for name in names))
    return table


def accuracy(rows):
    mine = [row for row in rows if "wrong_side" in row and row["on"].endswith("n = 32") and at_its_best(row["peer"])]
    return grid(["on a slide", "surface", "distance, of D: p50 / p99", "normal, degrees: p50 / p99", "wrong side"],
                ([row["peer"], row["on"], at(row, "distance_p50", "distance_p99"), at(row, "degrees_p50", "degrees_p99"),
                  f"{row['wrong_side']} of {row['places']}"] for row in mine))


def dabs(rows):
    sizes = ("1k", "10k", "100k")
    of = {row["figure"]: row for row in rows}
    tools = [name.split(",")[0] for name in of if name.endswith("1k samples, whole dab")]

    def cell(tool, size):
        row = of[f"{tool}, {size} samples, whole dab"]
        return f"{at(row, 'p50', 'p90')}" + (f" ({target(row)})" if target(row) else "")

    def beside(tool, size):
        row = of.get(f"{tool}, {size} samples, plain mesh")
        return f"{number(row['times slabs'])}" if row else ""
    return grid(["tool", *(f"{s} samples: p50 / p90, µs" for s in sizes), "plain mesh, × of slabs"],
                ([tool, *(cell(tool, s) for s in sizes), " / ".join(beside(tool, s) for s in sizes if beside(tool, s))] for tool in tools))


def other_dabs(rows):
    shown = [row for row in rows if "whole dab" not in row["figure"] and "plain mesh" not in row["figure"] and
             not row["figure"].startswith("ball cut")]
    return grid(["figure", "on", "value", "target"],
                ([row["figure"] + (f", {row['clock']}" if row["unit"] == "ms" else ""), row["on"], with_unit(row["value"], row["unit"]), target(row)]
                 for row in shown))


def cuts(rows):
    shown = [row for row in rows if row["figure"].startswith("ball cut")]
    kinds = list(dict.fromkeys(row["figure"].rsplit(", ", 2)[1] for row in shown))
    sizes = list(dict.fromkeys((row["on"], row["figure"].split(", ")[1]) for row in shown))
    of = {(row["on"], row["figure"].split(", ")[1], row["figure"].rsplit(", ", 2)[1]): row for row in shown}

    def cell(on, size, kind):
        row = of[on, size, kind]
        return f"{number(row['value'])} / {number(row['rim ripple'])}"
    return grid(["rms / ripple, spacings", "radius, spacings", *kinds],
                ([on, size.split("=")[1].strip(), *(cell(on, size, kind) for kind in kinds)] for on, size in sizes))


def by_surface(rows):
    """A row per figure with its target, a column per surface."""
    surfaces = list(dict.fromkeys(row["on"] for row in rows))
    of = {(row["figure"], row["on"]): row for row in rows}

    def cell(name, on):
        row = of.get((name, on))
        return (with_unit(row["value"], row["unit"]) + (MISSED if MISSED in target(row) else "")) if row else ""
    goals = {row["figure"]: target(row).replace(MISSED, "") for row in rows}
    return grid(["figure", "target", *surfaces], ([name, goals[name], *(cell(name, on) for on in surfaces)] for name in goals))


def clay(rows):
    return by_surface([row for row in rows if "on cut slabs" not in row["figure"] and not row["figure"].startswith("rim ")])


def clay_detail(rows):
    """What stands beside some of the figures."""
    shown = [("clay below, least of a default conversion's fibres", ("one in ten", "median", "share under 2 %"), "%"),
             ("clay above, least of a default conversion's fibres", ("one in ten", "median", "share under 2 %"), "%"),
             ("ball of 0.5 % of the diagonal, places over 5 % of its depth off, told ones included", ("places", "told"), ""),
             *((f"cut of {depth} % of the diagonal, places not reached", ("places", "of these not told"), "") for depth in (5, 9))]
    surfaces = list(dict.fromkeys(row["on"] for row in rows if row["figure"] == shown[0][0]))
    of = {(row["figure"], row["on"]): row for row in rows}
    return grid(["figure", *surfaces],
                ([f"{name}: {', '.join(keys)}",
                  *(" / ".join(with_unit(of[name, on][key], unit) for key in keys) for on in surfaces)] for name, keys, unit in shown))


def clay_readers(rows):
    return by_surface([row for row in rows if "on cut slabs" in row["figure"]])


def rims(rows):
    return by_surface([row for row in rows if row["figure"].startswith("rim ")])


def frames(rows):
    return grid(["figure", "on", "value", "clock", "target"],
                ([row["figure"], row["on"], with_unit(row["value"], row["unit"]), row["clock"], target(row)] for row in rows))


def conversions(rows):
    def cell(row):
        if row["mode"] == "refused":
            return [row["model"], "", "refused", number(row["cpu_s"]), number(row["peak_mib"]), "", "", ""]
        return [row["model"], number(row["triangles"]), f"{number(row['slabs'])} ({row['asked']})" + ("" if row["mode"] == "certified" else f" {row['mode']}"),
                f"{number(row['cpu_s'])} ({number(row['wall_s'])})", number(row["peak_mib"]),
                f"{100 * row['single_share']:.4g} %", *(" / ".join(number(x) for x in row[key]) for key in ("rms", "most"))]
    return grid(["model", "triangles", "slabs (target)", "CPU s (wall)", "MiB", "single", "rms", "greatest"], map(cell, rows))


def by_resolution(n):
    def table(rows):
        return conversions([row for row in rows if row["n"] == n])
    return table


def file_figures(rows):
    return grid(["of all files", "value", "of", "median", "target"],
                ([row["figure"] + (f": `{row['file']}`" if "file" in row else ""), with_unit(row["value"], row["unit"]), number(row["of"]),
                  at(row, "p50"), target(row)] for row in rows if "figure" in row))


def outcomes(rows):
    """A row per folder of files."""
    folders = {}
    for row in rows:
        if "file" in row and "outcome" in row:
            folders.setdefault(row["file"].rsplit("/", 1)[0], []).append(row)
    def cells(of):
        found = [row["outcome"] for row in of]
        return [number(len(of)), *(number(found.count(what)) for what in ("certified", "tolerant", "refused")),
                number(max(row["cpu_s"] for row in of)), number(max(row["peak_mib"] for row in of)), number(sum(1 for row in of if row["missed"]))]
    return grid(["folder", "files", "certified", "tolerant", "refused", "CPU s, the most", "MiB, the most", "miss a goal"],
                ([f"`{folder}`", *cells(of)] for folder, of in folders.items()))


def solids(rows):
    shown = [row for row in rows if "outcome" in row and "/solids/" in row["file"]]
    return grid(["solid", "triangles", "slabs (target)", "mode", "CPU s (wall)", "MiB", "bound", "covered", "`verify --source`"],
                ([row["file"].rsplit("/", 1)[1].rsplit(".", 1)[0], number(row["triangles"]), f"{number(row['slabs'])} (200)", row["outcome"],
                  f"{number(row['cpu_s'])} ({number(row['wall_s'])})", number(row["peak_mib"]), number(row["bound"]),
                  f"{100 * row['covered_share']:.4g} %", row["verify_said"]] if row["outcome"] != "refused" else
                 [row["file"].rsplit("/", 1)[1], "", "", "refused", number(row["cpu_s"]), number(row["peak_mib"]), "", "", row["said"]] for row in shown))


def told_of_files(rows):
    """What was said of each file that has no certificate; of a verdict its reasons, without what all of them begin or end with."""
    def text(row):
        reasons = row["said"].split(";")[0].removeprefix("Tolerant, as ").removesuffix(", more than 1 % of its diagonal")
        return (row["said"] if row["outcome"] == "refused" else reasons).replace("|", "\\|")
    same = {}  # files of a folder of which the same is said
    for row in rows:
        if row.get("outcome") in ("tolerant", "refused"):
            same.setdefault((row["file"].rsplit("/", 1)[0], row["outcome"], text(row)), []).append(row["file"])
    return grid(["file", "outcome", "said"],
                ([f"`{files[0]}`" if len(files) == 1 else f"{len(files)} files of `{folder}`", outcome, said]
                 for (folder, outcome, said), files in same.items()))


def safety(rows):
    """The worst figure of each test and threshold."""
    groups = {}
    for row in rows:
        if "holds" in row:
            bound = "at_most" if "at_most" in row else "at_least"
            groups.setdefault((row["test"], bound, row[bound], row["unit"]), []).append(row)
    lines = []
    for (test, bound, limit, unit), of in groups.items():
        worst = (max if bound == "at_most" else min)(of, key=lambda row: row["value"])
        more = f" (worst of {len(of)})" if len(of) > 1 else ""
        lines.append([test, worst["figure"].strip() + more, with_unit(worst["value"], unit),
                      f"{'≤' if bound == 'at_most' else '≥'} {with_unit(limit, unit)}" + ("" if all(row["holds"] for row in of) else MISSED)])
    return grid(["test", "figure", "measured", "threshold"], lines)


# Name of a table -> (part that it is made of, function).
TABLES = {
    "paper": ("paper", paper), "queries": ("query", queries), "growth": ("touch", growth),
    "touch": ("touch", touch_figures), "touch-surfaces": ("touch", touch_surfaces),
    "peers-pumpkin": ("touch", peers("pumpkin, n = 32")), "peers-bunny": ("touch", peers("bunny, n = 32")),
    "peers-igea": ("touch", peers("igea, n = 32")), "accuracy": ("touch", accuracy),
    "dabs": ("dab", dabs), "dab-figures": ("dab", other_dabs), "cuts": ("dab", cuts), "frames": ("render", frames),
    "clay": ("clay", clay), "clay-detail": ("clay", clay_detail), "clay-readers": ("clay", clay_readers), "rims": ("clay", rims),
    "samples": ("convert", by_resolution("per slab")), "samples-63": ("convert", by_resolution(63)),
    "scans": ("scans", by_resolution("per slab")), "scans-63": ("scans-63", by_resolution(63)),
    "files": ("files", file_figures), "outcomes": ("files", outcomes), "solids": ("files", solids), "told": ("files", told_of_files),
    "safety": ("safety", safety),
}


# Made and compared by a test: ctest -R verify.report.
ELSEWHERE = {"verifier"}


def machines(results):
    """Each machine once, with what its results say of it."""
    seen = {result["machine"]: result for result in results}
    return grid(["machine", "processor", "cores", "memory, GiB"],
                ([f"`{name}`", of["cpu"], str(of["cores"]), str(of["memory_gib"])] for name, of in sorted(seen.items())))


def table_of(name, results):
    """The lines of a table; None where nothing has its name, or no result its part."""
    if name == "machines":
        return machines(results) if results else None
    if name not in TABLES:
        return None
    part, lines_of = TABLES[name]
    found = [result for result in results if result["bench"] == part]
    lines = []
    for result in found:
        lines += ([""] if lines else []) + [said_of(result), "", *lines_of(result["rows"])]
    return lines or None


def check(root, write=False):
    """One line per table of docs/evidence/ that differs from its data; with `write`, the pages are written instead."""
    results, offences = load(root / "bench/results"), []
    for page in sorted((root / "docs/evidence").glob("*.md")):
        text = page.read_text(encoding="utf-8")

        def replaced(match):
            name, where = match[2], f"{page.relative_to(root)}: table {match[2]}"
            if name in ELSEWHERE:
                return match[0]
            lines = table_of(name, results)
            if lines is None:
                offences.append(f"{where}: " + ("no result has its part" if name in TABLES else "there is no such table"))
                return match[0]
            new = match[1] + "\n" + "\n".join(lines) + "\n\n" + match[3]
            if new != match[0] and not write:
                offences.append(f"{where}: differs from bench/results; run tools/result_tables.py --write")
            return new
        new = MARK.sub(replaced, text)
        if write and new != text:
            page.write_text(new, encoding="utf-8")
    return offences


def main(arguments):
    places = [word for word in arguments if word != "--write"]
    if len(places) > 1 or any(word.startswith("-") for word in places):
        print(__doc__, file=sys.stderr)
        return 2
    root = pathlib.Path(places[0]).resolve() if places else pathlib.Path(__file__).resolve().parent.parent
    offences = check(root, "--write" in arguments)
    for offence in offences:
        print(offence)
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
