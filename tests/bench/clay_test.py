"""What the benchmark of clay says: the acceptance table's figures, each with its goal; what does not depend on the clock holds."""

import json
import math
import unittest

from form import numbers, run

# A figure's name, and its goal.
GOALS = {
    "fibres with 5 % below, of those where the body is 20 % thick": {"at_least": 85},
    "conversion, beside --thickness 0.1": {"at_most": 1.2},
    "ball of 0.5 % of the diagonal, places over 5 % of its depth off, told ones included": {"at_most": 0},
    "ball of 0.5 % of the diagonal, rms of its depth, the worst place not told": {"at_most": 5},
    "ball of 0.5 % of the diagonal, largest miss not told, of 0.3 spacings times the slope": {"at_most": 1},
    "cut of 5 % of the diagonal, places not reached": {"at_most": 10},
    "cut of 5 % of the diagonal, rms of its depth where reached, the worst": {"at_most": 1},
    "cut of 5 % of the diagonal, samples at the end of their fibres where reached, the worst": {"at_most": 0.1},
    "cut of 9 % of the diagonal, places not reached": {"at_most": 30},
    "cut of 9 % of the diagonal, rms of its depth where reached, the worst": {"at_most": 3},
    "cut of 9 % of the diagonal, samples at the end of their fibres where reached, the worst": {"at_most": 0.1},
    "slabs added per place, r 0.005, s 5e-4": {"at_most": 90},
    "samples of the model after such places": {"at_most": 1.05},
    "finer grids move the surface": {"at_most": 2e-7},
    "least angle after 20 generations, of its root's": {"at_least": 0.5},
    "rim of a ball of 12 spacings, spacing halved, height ripple": {"at_most": 0.015},
    "rim of a ball of 12 spacings, spacing halved, normal ripple": {"at_most": 0.9},
    "frames of 1/60 s without a publication, a stroke of 1 s over coarse slabs": {"at_most": 0},
    **{f"{what} on cut slabs": {"at_most": 1.1} for what in ("query", "nearest point", "tick", "dab")},
}
# Figures of which the short form is enough to see that they hold: no clock, and no number of places.
HOLDS = (
    "finer grids move the surface", "least angle after 20 generations, of its root's", "slabs added per place, r 0.005, s 5e-4",
    "ball of 0.5 % of the diagonal, rms of its depth, the worst place not told",
)


class Clay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        started = run("clay", "--json")
        assert started.returncode == 0, started.stderr
        cls.figures = json.loads(started.stdout)["clay"]["figures"]

    def of(self, name):
        found = [f for f in self.figures if f["name"] == name]
        self.assertTrue(found, name)
        return found

    def test_every_number_is_finite(self):
        for where, number in numbers(self.figures):
            self.assertTrue(math.isfinite(number), f"{where}: {number}")

    def test_every_goal_is_beside_its_figure(self):
        for name, goal in GOALS.items():
            for figure in self.of(name):
                self.assertEqual(figure["goal"], goal, name)
                ((kind, bound),) = goal.items()
                met = figure["value"] <= bound if kind == "at_most" else figure["value"] >= bound
                self.assertEqual(figure["met"], met, name)

    def test_what_needs_no_long_run_holds(self):
        for name in HOLDS:
            for figure in self.of(name):
                self.assertTrue(figure["met"], figure)

    def test_what_was_not_touched_keeps_its_bits(self):
        (figure,) = [f for f in self.figures if f["name"].startswith("slabs not touched, the same bits")]
        self.assertEqual((figure["value"], figure["met"]), (100, True))
        self.assertGreater(figure["more"]["slabs"], 10)

    def test_no_place_misses_its_cut_untold(self):
        for depth in (5, 9):
            (figure,) = self.of(f"cut of {depth} % of the diagonal, places not reached")
            self.assertEqual(figure["more"]["of these not told"], 0)

    def test_clay_is_told_with_its_least_tenth_and_share(self):
        for side in ("below", "above"):
            (figure,) = self.of(f"clay {side}, least of a default conversion's fibres")
            self.assertLessEqual(figure["value"], figure["more"]["one in ten"])
            self.assertLessEqual(figure["more"]["one in ten"], figure["more"]["median"])
            self.assertLessEqual(figure["more"]["share under 2 %"], 100)

    def test_what_people_read_has_the_goals(self):
        text = run("clay")
        self.assertEqual(text.returncode, 0, text.stderr)
        for words in ("at most 1.2", "at least 85", "per place", "wall"):
            self.assertIn(words, text.stdout)


if __name__ == "__main__":
    unittest.main()
