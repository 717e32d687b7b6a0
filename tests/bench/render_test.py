"""What the benchmark of frames says: every figure a number, goals beside it. Never how fast."""

import json
import math
import unittest

from form import numbers, run

# A figure's name, and what it may be in the figure's unit.
GOALS = {
    "whole frame, matcap and hollows": {"at_most": 33},
    "frame when nothing changed": {"at_most": 0.05},
    "GPU memory, of classic": {"at_most": 0.25},
    "moving camera, times cheaper": {"at_least": 2},
    "frame of a stroke, times cheaper": {"at_least": 50},
    "display follows a dab, normals included": {"at_most": 0.5},
}


class Render(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        started = run("render", "--json")
        assert started.returncode == 0, started.stderr
        cls.render = json.loads(started.stdout, parse_constant=lambda text: math.nan)["render"]
        cls.figures = cls.render["figures"]

    def test_every_number_is_finite_and_not_negative(self):
        for where, number in numbers(self.render):
            self.assertTrue(math.isfinite(number) and number >= 0, f"{where}: {number}")

    def test_every_goal_is_beside_its_figure(self):
        self.assertLessEqual(set(GOALS), {f["name"] for f in self.figures})
        for figure in self.figures:
            self.assertEqual(figure.get("goal"), GOALS.get(figure["name"]), figure["name"])
            if "goal" in figure:
                (kind, bound), = figure["goal"].items()
                self.assertEqual(figure["met"], figure["value"] <= bound if kind == "at_most" else figure["value"] >= bound)

    def test_the_peer_stands_beside_the_whole_frame(self):
        (classic,) = [f for f in self.figures if f["name"] == "the same, classic buffers"]
        self.assertGreater(classic["value"], 0)
        self.assertTrue(self.render["device"])

    def test_the_table_has_every_figure(self):
        table = run("render")
        self.assertEqual(table.returncode, 0, table.stderr)
        for figure in self.figures:
            self.assertIn(figure["name"], table.stdout)


if __name__ == "__main__":
    unittest.main()
