"""What the benchmark of dabs says: every figure a number, goals beside it, sizes told. Never how fast."""

import json
import math
import unittest

from form import numbers, run

TOOLS = ("carve", "deposit", "paint", "smooth", "flatten", "inflate", "clay", "layer", "mask", "unmask")
SIZES = ("1k", "10k", "100k")
# A figure's name, and what it may be at most in the figure's unit.
GOALS = {
    **{f"{tool}, {size} samples, whole dab": goal
       for tool in ("carve", "deposit", "paint") for size, goal in (("10k", 60), ("100k", 400))},
    "smooth, 10k samples, whole dab": 100,
    **{f"{tool}, 10k samples, by mouse, pick included": 100 for tool in ("carve", "deposit", "paint", "smooth")},
    **{f"{tool}, 1k samples, growth": 1.1 for tool in ("carve", "deposit", "paint", "smooth")},
    "memory per triangle, one layer": 5,
    "memory per triangle, with colour": 8,
    "ball of 0.5 % of the diagonal, rms of its depth": 5,
}
CLOCKS = {"us": {"thread CPU"}, "times": {"thread CPU"}, "ms": {"process CPU", "wall"}, "bytes": {"none"},
          "bytes each": {"none"}, "spacings": {"none"}, "%": {"none"}}


class Dab(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        started = run("dab", "--json")
        assert started.returncode == 0, started.stderr
        cls.dab = json.loads(started.stdout, parse_constant=lambda text: math.nan)["dab"]
        cls.figures = cls.dab["figures"]

    def of(self, name):
        found = [f for f in self.figures if f["name"] == name]
        self.assertTrue(found, name)
        return found

    def test_every_number_is_finite_and_not_negative(self):
        for where, number in numbers(self.dab):
            self.assertTrue(math.isfinite(number) and number >= 0, f"{where}: {number}")

    def test_every_goal_is_beside_its_figure(self):
        for name, goal in GOALS.items():
            for figure in self.of(name):
                self.assertEqual(figure["goal"], {"at_most": goal}, name)
                self.assertEqual(figure["met"], figure["value"] <= goal, name)
        for figure in self.figures:
            self.assertEqual("goal" in figure, figure["name"] in GOALS, figure["name"])

    def test_each_tool_is_there_in_each_size_with_what_it_changed(self):
        for tool in TOOLS:
            for size in SIZES:
                (figure,) = self.of(f"{tool}, {size} samples, whole dab")
                samples, wanted = figure["more"]["samples"], figure["more"]["wanted"]
                self.assertEqual(figure["within_10_percent"], 0.9 * wanted <= samples <= 1.1 * wanted, figure)
                self.assertGreater(samples, 0.5 * wanted, figure)
                self.assertLess(samples, 2 * wanted, figure)
                self.assertGreaterEqual(figure["percentiles"]["p99"], figure["percentiles"]["p50"])

    def test_the_plain_mesh_changes_as_much(self):
        for tool in TOOLS[:4]:
            for size in SIZES:
                (plain,) = self.of(f"{tool}, {size} samples, plain mesh")
                (slabs,) = self.of(f"{tool}, {size} samples, whole dab")
                self.assertAlmostEqual(plain["more"]["times slabs"], plain["value"] / slabs["value"], delta=0.01)
                self.assertGreater(plain["more"]["samples"], 0.5 * plain["more"]["wanted"], plain)

    def test_an_exact_cut_into_a_flat_sheet_is_that_of_a_plain_mesh_and_a_blend_evens_its_rim(self):
        def flat(how):
            (figure,) = [f for f in self.of(f"ball cut, r/h = 6, {how}, rms") if f["surface"] == "flat sheet"]
            return figure
        exact, blended, plain = flat("exact"), flat("blended"), flat("plain mesh")
        self.assertAlmostEqual(exact["value"], plain["value"], delta=1e-3)
        self.assertAlmostEqual(exact["more"]["rim ripple"], plain["more"]["rim ripple"], delta=1e-3)
        self.assertGreater(exact["value"], 0)
        self.assertLess(blended["more"]["rim ripple"], exact["more"]["rim ripple"])

    def test_a_larger_stroke_leaves_more_for_undo(self):
        undo = [f["value"] for f in self.figures if f["name"].startswith("undo of a stroke")]
        self.assertEqual(len(undo), 3)
        self.assertEqual(undo, sorted(undo))
        self.assertGreater(undo[0], 0)

    def test_strokes_are_saved_and_the_file_opens(self):
        for name in ("saving a stroke of 1k samples", "saving a stroke of 10k samples", "opening the file"):
            self.assertEqual({f["clock"] for f in self.of(name)}, {"process CPU", "wall"})
        (file,) = self.of("file, per stroke of 1k samples")
        self.assertGreater(file["more"]["file, MB"], file["more"]["without strokes, MB"])

    def test_clocks_are_named(self):
        for figure in self.figures:
            self.assertIn(figure["clock"], CLOCKS[figure["unit"]], figure["name"])

    def test_what_people_read_has_the_goals_and_says_how_it_was_taken(self):
        text = run("dab")
        self.assertEqual(text.returncode, 0, text.stderr)
        for words in ("at most 60", "at most 400", "at most 1.1", "plain mesh", "wall", "load average", "held as undo does"):
            self.assertTrue(words in text.stdout, words)


if __name__ == "__main__":
    unittest.main()
