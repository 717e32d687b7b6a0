"""The haptic hand beside the mouse: the simulated one, its plots and meters, and what must switch its forces off."""

import time
import unittest

import studio
from studio import Case, SOAK, Studio, measured, model, relief, wait


class SimulatedHand(Case):
    """The simulated hand feels the model while the mouse sculpts it."""

    SECONDS = 60 if SOAK else 6

    def test_01_servo_beside_the_mouse(self):
        file = model()
        alone = relief("touch", model(), "--device", "sim:hand", "--seconds", 2, "-o", studio.folder() / "alone.csv", "--json")
        s = Studio(file, "--device", "simulated")
        s.press("Deposit")
        mark = s.log.mark()
        self.assertIn("simulated", s.log.wait("hand", mark)["device"])
        self.assertEqual(s.described("Device"), s.log.last("hand")["state"])
        panel = s.find("Device panel")
        plots_before = s.picture(studio.rect(panel))
        end = time.monotonic() + self.SECONDS
        strokes = 0
        while time.monotonic() < end:
            u, v = 0.42 + 0.02 * (strokes % 8), 0.42 + 0.03 * (strokes % 5)
            made = s.stroke((u, v), (u + 0.03, v + 0.02), samples=0)
            self.assertGreater(made["samples"], 0)
            strokes += 1
        told = [e for e in s.log.since(mark, "hand")]
        self.assertGreater(len(told), self.SECONDS / 2)
        ticks = told[-1]["ticks"] - told[0]["ticks"]
        self.assertGreater(ticks, 0)
        self.assertGreater(max(e["force"] for e in told), 0, "the hand feels the surface")
        self.assertNotEqual(s.picture(studio.rect(panel)), plots_before, "plots move")
        measured("servo's ticks, late ones, CPU p99.9 beside the window and the mouse",
                 f"{ticks}, {told[-1]['late'] - told[0]['late']}, {told[-1]['cpu_us_p999']} us", "no more late ones than without a window")
        servo = alone["servo"]
        measured("the same without a window", f"{servo['ticks']}, {servo['overruns']}, {servo['compute_ns_p999'] / 1000} us", "")
        self.assertTrue(s.close())

    def test_02_forces_off(self):
        s = Studio(model(), "--device", "simulated")
        s.log.wait("hand", 0, lambda e: e["force"] > 0, patience=3 * studio.PATIENCE)
        for chord in (("Pause",), ("Escape", "Escape")):
            with self.subTest(chord):
                s.hand.at(*s.pixel(0.5, 0.5))
                mark = s.log.mark()
                s.hand.keys(*chord)
                s.log.wait("banner", mark)
                alert = wait("the banner", lambda: next(s.all(lambda o: o.getRoleName() in ("alert", "notification") and studio.shows(o)), None))
                self.assertIn("off", (alert.name + alert.description).lower())
                self.assertIn("off", s.described("Status", "label").lower())
                off = s.log.wait("hand", mark, lambda e: e["force"] == 0)
                later = s.log.mark()
                s.log.wait("hand", later)
                self.assertEqual([e["force"] for e in s.log.since(later, "hand")][0], 0, off)
                s.press("Forces on again")
                s.log.wait("hand", later, lambda e: e["force"] > 0, patience=3 * studio.PATIENCE)
        self.assertTrue(s.close())


if __name__ == "__main__":
    studio.main()
