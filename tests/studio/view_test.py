"""What turns the camera: by mouse and key, in each map."""

import math
import unittest

import studio
from picture import channels
from studio import OneStudio, Studio, model


class Camera(OneStudio):
    """Orbit, pan, zoom, views: the numbers of the camera and where the model is on the screen."""

    def setUp(self):
        super().setUp()
        s = self.studio
        s.hand.at(*s.pixel(0.5, 0.5))
        mark = s.log.mark()
        s.hand.keys("Home", "3", "1")  # whatever stood there, something is drawn
        s.hands_off()
        s.settled(mark=mark, samples=4)
        self.start = s.log.last("camera")

    def turned(self, act):
        """The camera after what act() did."""
        s = self.studio
        s.hand.at(*s.pixel(0.5, 0.5))
        mark = s.log.mark()
        act()
        s.hands_off()
        s.log.wait("camera", mark)
        s.settled(mark=mark, samples=4)
        return s.log.last("camera")

    def silhouette(self):
        """(left, right) of the model in the rows of the middle, screen pixels: what is not the background at the row's start."""
        s = self.studio
        x, y, width, height = s.viewport()
        picture = s.picture((x, y + int(0.3 * height), width, int(0.4 * height)))
        seen = []
        for k in range(0, picture.height, 4):
            row = [channels(word) for word in picture.row(k)]
            other = [i for i, pixel in enumerate(row) if max(abs(a - b) for a, b in zip(pixel, row[0])) > 24]
            seen += [other[0], other[-1]]
        return x + min(seen), x + max(seen)

    def assert_near(self, a, b, within):
        self.assertLess(math.dist(a, b), within, (a, b))

    def away(self, camera):
        return math.dist(camera["eye"], camera["target"])

    def back(self, camera):
        """The unit vector from what is looked at to the eye."""
        return [(e - t) / self.away(camera) for e, t in zip(camera["eye"], camera["target"])]

    def test_01_orbit(self):
        s = self.studio
        for how in ({"button": 2}, {"button": 1, "keys": ["Alt_L"]}):
            before = s.log.last("camera")
            after = self.turned(lambda: s.drag((0.4, 0.5), (0.6, 0.5), **how))
            self.assert_near(after["target"], before["target"], 1e-6)
            self.assertAlmostEqual(self.away(after), self.away(before), delta=1e-3)
            self.assertGreater(math.dist(after["eye"], before["eye"]), 0.2 * self.away(before))

    def test_02_pan(self):
        s = self.studio
        left, right = self.silhouette()
        width = s.viewport()[2]
        after = self.turned(lambda: s.drag((0.45, 0.5), (0.55, 0.5), button=2, keys=["Shift_L"]))
        moved = [a - b for a, b in zip(after["eye"], self.start["eye"])]
        self.assert_near([a - b for a, b in zip(after["target"], self.start["target"])], moved, 1e-6)
        self.assertGreater(math.hypot(*moved), 0)
        new_left, new_right = self.silhouette()
        self.assertAlmostEqual(new_left - left, 0.1 * width, delta=0.01 * width)
        self.assertAlmostEqual(new_right - right, 0.1 * width, delta=0.01 * width)

    def test_03_zoom(self):
        s = self.studio
        left, right = self.silhouette()

        def wheel():
            for _ in range(3):
                s.hand.down(5)
                s.hand.up(5)
        after = self.turned(wheel)
        factor = self.away(after) / self.away(self.start)
        self.assertGreater(factor, 1.1)
        new_left, new_right = self.silhouette()
        self.assertLess(new_right - new_left, 0.95 * (right - left))
        dragged = self.turned(lambda: s.drag((0.5, 0.5), (0.5, 0.4), button=2, keys=["Control_L"]))
        self.assertNotAlmostEqual(self.away(dragged) / self.away(after), 1, delta=0.05)

    def test_04_views_and_lens(self):
        s = self.studio
        for key, axis in (("3", 0), ("7", 1), ("1", 2)):
            for chord, side in ((f"Control_L+{key}", -1), (key, 1)):
                camera = self.turned(lambda: s.hand.keys(chord))
                self.assertAlmostEqual(self.back(camera)[axis], side, delta=1e-3, msg=chord)
        self.assertTrue(self.turned(lambda: s.hand.keys("5"))["parallel"])
        self.assertFalse(self.turned(lambda: s.hand.keys("5"))["parallel"])
        self.turned(lambda: s.drag((0.4, 0.5), (0.6, 0.5), button=2, keys=["Shift_L"]))
        home = self.turned(lambda: s.hand.keys("Home"))
        left, right = self.silhouette()
        x, _, width, _ = s.viewport()
        self.assertAlmostEqual((left + right) / 2, x + width / 2, delta=0.03 * width)
        self.assertGreater(self.away(home), 0)

    STEP = math.radians(15)

    def test_05_steps_by_key(self):
        s = self.studio
        # From the front the eye stands on +z. A step goes to a side, one of the other key comes back.
        sine, cosine = math.sin(self.STEP), math.cos(self.STEP)
        for key, other, back in (("6", "4", (sine, 0, cosine)), ("4", "6", (-sine, 0, cosine)),
                                 ("8", "2", (0, sine, cosine)), ("2", "8", (0, -sine, cosine))):
            with self.subTest(key):
                there = self.turned(lambda: s.hand.keys(key))
                self.assert_near(self.back(there), back, 1e-3)
                again = self.turned(lambda: s.hand.keys(other))
                self.assert_near(self.back(again), (0, 0, 1), 1e-3)
        for key, other, up in (("4", "6", (-sine, cosine, 0)), ("6", "4", (sine, cosine, 0))):
            with self.subTest(f"roll {key}"):
                rolled = self.turned(lambda: s.hand.keys(f"Shift_L+{key}"))
                self.assert_near(rolled["up"], up, 1e-3)
                self.assert_near(self.back(rolled), (0, 0, 1), 1e-3)
                self.assert_near(self.turned(lambda: s.hand.keys(f"Shift_L+{other}"))["up"], (0, 1, 0), 1e-3)

    def test_08_axis_ball(self):
        s = self.studio
        x, y, width, _ = s.viewport()
        corner = s.picture((x + width - 110, y, 110, 110))
        red = [(i % 110, i // 110) for i, (r, g, b) in enumerate(map(channels, corner.words)) if r > g + 60 and r > b + 60]
        right = max(p[0] for p in red)
        dot = [p for p in red if p[0] > right - 12]  # from the front, +x is the rightmost
        px, py = (sum(p[k] for p in dot) / len(dot) for k in (0, 1))
        camera = self.turned(lambda: s.hand.click(corner.x + px, corner.y + py))
        self.assertAlmostEqual((camera["eye"][0] - camera["target"][0]) / self.away(camera), 1, delta=1e-3)

    def test_06_a_drag_on_a_panel_turns_nothing(self):
        s = self.studio
        x, y, width, height = studio.rect(s.find("Tool panel"))
        s.settled()
        mark, before = s.log.mark(), s.picture()
        s.hand.at(x + width // 2, y + height - 12)
        for button in (1, 2):
            s.hand.down(button)
            s.hand.path([(x + width // 2 + k % 30, y + height - 12 - k) for k in range(40)])
            s.hand.up(button)
        s.hands_off()
        self.assertEqual(s.log.since(mark, "camera"), [])
        self.assertEqual(s.picture(), before)

    def middle_click(self):
        """With Alt, on the model right of its middle; the cameras after it, and after a turn so that we know when to look."""
        s = self.studio
        mark = s.log.mark()
        x, y = s.pixel(0.56, 0.45)
        s.hand.hold_key("Alt_L")
        s.hand.click(x, y, 2)
        s.hand.release_key("Alt_L")
        self.turned(lambda: s.hand.keys("3"))
        return s.log.since(mark, "camera")

    def test_07_a_click_chooses_what_is_turned_around(self):
        targets = [camera["target"] for camera in self.middle_click()]
        self.assertGreater(math.dist(targets[-1], self.start["target"]), 0.02 * self.away(self.start))


class IndustryMap(Camera):
    """The other map: Alt with the left, middle and right button."""

    @classmethod
    def setUpClass(cls):
        studio.settings("[input]", "map=industry")
        cls.studio = Studio(model())

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        studio.settings()

    def test_01_orbit(self):
        after = self.turned(lambda: self.studio.drag((0.4, 0.5), (0.6, 0.5), keys=["Alt_L"]))
        self.assert_near(after["target"], self.start["target"], 1e-6)
        self.assertGreater(math.dist(after["eye"], self.start["eye"]), 0.2 * self.away(self.start))

    def test_02_pan(self):
        after = self.turned(lambda: self.studio.drag((0.45, 0.5), (0.55, 0.5), button=2, keys=["Alt_L"]))
        moved = [a - b for a, b in zip(after["eye"], self.start["eye"])]
        self.assert_near([a - b for a, b in zip(after["target"], self.start["target"])], moved, 1e-6)
        self.assertGreater(math.hypot(*moved), 0)

    def test_03_zoom(self):
        after = self.turned(lambda: self.studio.drag((0.5, 0.5), (0.5, 0.4), button=3, keys=["Alt_L"]))
        self.assertNotAlmostEqual(self.away(after) / self.away(self.start), 1, delta=0.05)

    def test_04_no_other_key_makes_it_something_else(self):
        # Alt and the left button turn, whatever else is held; in Blender's map Shift would shift and Ctrl zoom.
        s = self.studio
        for key in ("Shift_L", "Control_L"):
            before = s.log.last("camera")
            after = self.turned(lambda: s.drag((0.4, 0.5), (0.6, 0.5), keys=["Alt_L", key]))
            self.assert_near(after["target"], before["target"], 1e-6)
            self.assertAlmostEqual(self.away(after), self.away(before), delta=1e-3)

    def test_05_the_model_is_sculpted_without_it(self):
        s = self.studio
        s.press("Carve")
        mark = s.log.mark()
        made = s.stroke((0.45, 0.5), (0.55, 0.5))
        self.assertGreater(made["samples"], 0)
        self.assertEqual(s.log.since(mark, "camera"), [])

    def test_07_a_click_chooses_what_is_turned_around(self):
        # It does not: here the middle button shifts.
        for camera in self.middle_click():
            self.assert_near(camera["target"], self.start["target"], 1e-6)

    test_06_a_drag_on_a_panel_turns_nothing = None  # the same in all maps, as are keys and the ball of axes
    test_04_views_and_lens = test_05_steps_by_key = test_08_axis_ball = None


if __name__ == "__main__":
    studio.main()
