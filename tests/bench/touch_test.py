"""What the benchmark of touch says: every figure a number, goals beside it, peers with their accuracy. Never how fast."""

import json
import math
import re
import unittest

from form import numbers, run

# Part of a figure's name, and its goal in the figure's unit.
GOALS = {
    "tracked query, median": ("at_most", 0.1),
    "contact point, median": ("at_most", 0.5),
    "whole tick, p99.9": ("at_most", 10),
    "whole tick, core's own caches evicted before each, p99.9": ("at_most", 30),
    "whole tick, all caches evicted before each, p99.9": ("at_most", 30),
    "whole tick, core's own caches evicted before each, one pass, p99.9": ("at_most", 30),
    "whole tick, all caches evicted before each, one pass, p99.9": ("at_most", 30),
    "whole tick in a loop at 1 kHz, p99.9": ("at_most", 30),
    "whole tick, ball of 1 % of the diagonal, p99.9": ("at_most", 20),
    "whole tick, rigid tool of 1000 points, all in, p99.9": ("at_most", 300),
    "tracked query, times faster than Embree at its best": ("at_least", 10),
    "tracked query, growth of the median": ("at_most", 1.3),
}
REPORTED = ("ball of 0.3 %", "ball of 3 %", "points, half in", "memory busy", "memory of a servo")


class Touch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        started = run("touch", "--json")
        assert started.returncode == 0, started.stderr
        cls.touch = json.loads(started.stdout, parse_constant=lambda text: math.nan)["touch"]
        cls.figures = cls.touch["figures"]

    def of(self, name):
        return [f for f in self.figures if f["name"] == name]

    def test_every_number_is_finite_and_not_negative(self):
        for where, number in numbers(self.touch):
            self.assertTrue(math.isfinite(number) and number >= 0, f"{where}: {number}")

    def test_every_goal_is_beside_its_figure(self):
        for name, (kind, goal) in GOALS.items():
            found = self.of(name)
            self.assertTrue(found, name)
            self.assertEqual(found[0]["goal"], {kind: goal}, name)
            for figure in found:
                if "goal" in figure:
                    value, bound = figure["value"], figure["goal"].get(kind)
                    self.assertEqual(figure["met"], value <= bound if kind == "at_most" else value >= bound, figure)
                else:
                    self.assertNotIn("met", figure)
        for part in REPORTED:
            found = [f for f in self.figures if part in f["name"]]
            self.assertTrue(found, part)
            for figure in found:
                self.assertNotIn("goal", figure, part)

    def test_clocks_are_named(self):
        self.assertEqual({f["clock"] for f in self.figures}, {"thread CPU", "wall", "none"})
        for figure in self.figures:
            if figure["clock"] == "wall":
                self.assertIn("in a loop", figure["name"])

    def test_a_servo_takes_memory_and_one_of_many_points_as_much_as_they_are(self):
        for figure in self.figures:
            if figure["name"].startswith("memory of a servo"):
                self.assertGreater(figure["value"], 24_000 if "1000 points" in figure["name"] else 1_000)

    def test_tools_touch_where_they_are_timed(self):
        for figure in self.figures:
            if "touching_share" in figure:
                self.assertGreater(figure["touching_share"], 0.2, figure["name"])
                self.assertLess(figure["latched_share"], 0.2, figure["name"])

    def test_each_peer_is_there_plain_and_at_its_best_and_right(self):
        measured = {name: on for name, on in self.touch["same_surface"].items() if "skipped" not in on}
        self.assertTrue(measured)
        for name, on in measured.items():
            rows = on["rows"]
            for peer in ("Embree", "OpenVDB", "CGAL"):
                self.assertEqual(len([row for row in rows if row.startswith(peer)]), 2, peer)
            for row, of in rows.items():
                self.assertEqual(set(of["warm_ns"]), {"slide", "tap", "press", "jump", "hand"}, row)
                if row.startswith(("Embree", "CGAL", "Relief, closest")):
                    for way, at in of["accuracy"].items():
                        self.assertGreater(at["places"], 0)
                        self.assertLess(at["distance_error_of_diagonal"]["max"], 1e-6, f"{name}, {row}, {way}")
                        self.assertEqual((at["wrong_side"], at["without_answer"]), (0, 0), f"{name}, {row}, {way}")

    def test_what_people_read_has_the_goals_and_says_how_it_was_taken(self):
        text = run("touch")
        self.assertEqual(text.returncode, 0, text.stderr)
        for words in ("at most 30", "at least 10", "Embree", "against all triangles", "wall"):
            self.assertIn(words, text.stdout)
        evicted = re.search(r"evicted: (\d+) MiB are read and changed.*all caches: (\d+) MiB", text.stdout, re.DOTALL)
        self.assertLess(int(evicted[1]), int(evicted[2]))


if __name__ == "__main__":
    unittest.main()
