"""A fast hand: no motion is lost, and how long until it is seen."""

import statistics
import time
import unittest

import studio
from studio import Case, Studio, journal, measured, model, wait


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


if __name__ == "__main__":
    studio.main()
