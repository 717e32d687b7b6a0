"""A fast hand: no motion is lost, how long until it is seen, and what turns the camera."""

import math
import statistics
import time
import unittest

import studio
from picture import channels
from studio import Case, OneStudio, Studio, journal, measured, model, wait


def zigzag(left, right, top, count):
    """`count` pixels, each other than the one before, to and fro between left and right, a little lower each time."""
    points, x, y, step = [], left, top, 1
    for _ in range(count):
        if not left <= x + step <= right:
            step, y = -step, y + 1
        x += step
        points.append((x, y))
    return points


class Motion(Case):
    """Three seconds at 1 kHz."""

    MOTIONS = 3000

    def dragged(self, s, points):
        """The event of the stroke along the points; the press is at the first pixel's neighbour."""
        mark = s.log.mark()
        s.hand.at(points[0][0] - 1, points[0][1])
        s.hand.down()
        worst = s.hand.path(points, 1000)
        s.hand.up()
        made = s.log.wait("stroke", mark)
        measured("the hand's longest wait between two motions", f"{worst:.1f} ms", "1 ms; more is the machine's doing")
        return made

    def points_of(self, s):
        x, y, width, height = s.middle(0.2)
        return zigzag(x, x + width, y + height // 3, self.MOTIONS)

    def test_01_every_motion_is_taken(self):
        file = model()
        s = Studio(file)
        s.press("Carve")
        s.hands_off()
        s.settled()
        points = self.points_of(s)
        before, mark = s.picture(), s.log.mark()
        made = self.dragged(s, points)
        self.assertEqual(made["points"], 1 + self.MOTIONS)  # the press is one too
        s.hands_off()
        s.settled(made["revision"], mark)
        after = s.picture()
        box = before.difference_box(after, 4)
        left, right = min(p[0] for p in points), max(p[0] for p in points)
        for x in range(left, right + 1):  # no gap: each column of the way was cut
            column = (x, box[1], 1, box[3])
            self.assertGreater(before.crop(column).differing(after.crop(column), 2), 0, x)
        latencies = sorted(f["latency_ms"] for f in s.log.since(mark, "frame") if f["latency_ms"] > 0)
        measured("frames while the hand went", len(latencies), "60 a second")
        measured("from the oldest input of a frame to its picture, p50 and p99",
                 f"{statistics.median(latencies):.1f} and {latencies[int(0.99 * (len(latencies) - 1))]:.1f} ms", "16 and 33 ms")
        s.log.wait("saved", mark)
        times = [point[0] for point in journal(file)[-1]["points"]]
        self.assertEqual(times, sorted(times))
        self.assertAlmostEqual(times[-1] - times[0], self.MOTIONS / 1000, delta=1)  # the X server's clock, kept
        self.assertTrue(s.close())

    def test_02_compressed_events_would_be_missed(self):
        s = Studio(model(), environment={"LD_PRELOAD": str(studio.BIN / "libstudio_compressed.so")})
        s.press("Carve")
        self.assertLess(self.dragged(s, self.points_of(s))["points"], 1 + self.MOTIONS)
        self.assertTrue(s.close())


class Latency(Case):
    """From the hand to the pixel, measured outside. Only that it comes is asserted."""

    @classmethod
    def setUpClass(cls):
        cls.studio = Studio(model())
        cls.studio.press("Carve")

    @classmethod
    def tearDownClass(cls):
        cls.studio.close()

    def told(self, what, times, goal):
        self.assertNotIn(None, times)
        times = sorted(times)
        measured(what + ", p50 and p99", f"{statistics.median(times):.1f} and {times[int(0.99 * (len(times) - 1))]:.1f} ms", goal)

    def test_01_button(self):
        s = self.studio
        area = studio.rect(s.find("Deposit"))
        times = []
        for _ in range(10):
            s.hand.at(*s.pixel(0.5, 0.01))
            times.append(s.hand.changes(area, lambda: s.hand.at(area[0] + area[2] // 2, area[1] + area[3] // 2)))
            s.hand.changes(area, lambda: s.hand.at(*s.pixel(0.5, 0.01)))
        self.told("a tool button under the pointer", times, "1 ms")

    def test_02_ring(self):
        s = self.studio
        times = []
        for k in range(30):
            x, y = s.pixel(0.45 + 0.003 * k, 0.5)
            times.append(s.hand.changes((x - 60, y - 60, 120, 120), lambda: s.hand.at(x, y)))
        self.told("the brush ring follows", times, "8 ms")

    def test_03_dab(self):
        s = self.studio
        times = []
        for k in range(8):
            row, column = divmod(k, 4)
            x, y = s.pixel(0.41 + 0.05 * column, 0.42 + 0.05 * row)
            mark = s.log.mark()
            s.hand.at(x, y)
            s.settled()
            times.append(s.hand.changes((x + 3, y + 5, 6, 6), s.hand.down))  # inside the ring, beside its lines
            s.hand.up()
            s.log.wait("stroke", mark)
        self.told("a carved dab on the screen", times, "16 and 33 ms")

    def test_04_a_pause_of_50_ms_is_seen(self):
        s = self.studio
        x, y = s.pixel(0.5, 0.35)
        s.hand.at(x, y)

        def held_up():
            with s.stopped():
                at = s.hand.at(x + 40, y)
                time.sleep(0.05)  # this is the pause itself, not a wait for anything
            return at
        time_seen = s.hand.changes((x - 60, y - 60, 160, 120), held_up)
        self.assertIsNotNone(time_seen)
        self.assertGreater(time_seen, 50)


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
            camera = self.turned(lambda: s.hand.keys(key))
            back = [(e - t) / self.away(camera) for e, t in zip(camera["eye"], camera["target"])]
            self.assertAlmostEqual(back[axis], 1, delta=1e-3, msg=key)
        self.assertTrue(self.turned(lambda: s.hand.keys("5"))["parallel"])
        self.assertFalse(self.turned(lambda: s.hand.keys("5"))["parallel"])
        self.turned(lambda: s.drag((0.4, 0.5), (0.6, 0.5), button=2, keys=["Shift_L"]))
        home = self.turned(lambda: s.hand.keys("Home"))
        left, right = self.silhouette()
        x, _, width, _ = s.viewport()
        self.assertAlmostEqual((left + right) / 2, x + width / 2, delta=0.03 * width)
        self.assertGreater(self.away(home), 0)

    def test_05_axis_ball(self):
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
    test_04_views_and_lens = test_05_axis_ball = None


if __name__ == "__main__":
    studio.main()
