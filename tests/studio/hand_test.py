"""The haptic hand beside the mouse: the simulated one, its plots and meters, and what must switch its forces off."""

import csv
import time
import unittest

import studio
from picture import channels
from studio import Case, SOAK, Studio, measured, model, relief, wait


def alerts(s):
    return [o for o in s.all(lambda o: o.getRoleName() == "alert" and studio.shows(o))]


def meter(s):
    """Rows of the force meter that are lit, of those below the line of the limit: no other colour is there."""
    x, y, width, height = studio.rect(s.find("Force meter"))
    column = s.picture((x + 21, y + 60, 1, height - 94))  # through the middle of the column, without the words below it
    return sum(max(channels(word)) - min(channels(word)) > 60 for word in column.words)


class SimulatedHand(Case):
    """The simulated hand feels the model while the mouse sculpts it. Ticks that this machine's clock makes late are printed; that no
    tick waits for the window, and none is lost, clock_test.cpp asserts with a device on a clock of its own."""

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
        strokes, lit = 0, set()
        while time.monotonic() < end:
            lit.add(meter(s))
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
        self.assertGreater(max(lit), 0, "the force meter shows it")
        self.assertGreater(len(lit), 1, "and moves")
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
                alert = wait("the banner", lambda: alerts(s))[0]
                self.assertIn("off", (alert.name + alert.description).lower())
                self.assertIn("off", s.described("Status", "label").lower())
                off = s.log.wait("hand", mark, lambda e: e["force"] == 0)
                later = s.log.mark()
                s.log.wait("hand", later)
                self.assertEqual([e["force"] for e in s.log.since(later, "hand")][0], 0, off)
                wait("a force meter without a force", lambda: meter(s) == 0)
                self.assertEqual(s.described("Force meter"), "Forces are off.")
                s.press("Forces on again")
                wait("the banner to go", lambda: not alerts(s))
                s.log.wait("hand", later, lambda e: e["force"] > 0, patience=3 * studio.PATIENCE)
                wait("a force meter with one", lambda: meter(s) > 0, 3 * studio.PATIENCE)
        self.assertTrue(s.close())


class MouseProbe(Case):
    """The mouse feels: the button presses, the wheel presses deeper; the force is seen, and nothing is changed."""

    def force(self, s, ok):
        """The newest force that is as wanted, with the next words of the hand."""
        return s.log.wait("hand", s.log.mark(), lambda e: ok(e["force"]))["force"]

    def test_press_and_wheel(self):
        s = Studio(model(), "--device", "mouse")
        hash_before = s.log.last("opened")["hash"]
        s.press("Touch")
        s.hand.at(*s.pixel(0.5, 0.5))
        self.force(s, lambda force: force == 0)
        still, arrow = s.picture(), lambda: still.differing(s.picture(), 24)
        self.assertEqual(meter(s), 0, "the control: a mouse that only hovers presses nothing")
        s.hand.down()
        pressed = self.force(s, lambda force: force > 0)
        wait("the meter to show it", lambda: meter(s) > 0)
        wait("the arrow over the model", lambda: arrow() > 50)
        low = meter(s)
        for _ in range(4):
            s.hand.down(4)
            s.hand.up(4)
        self.force(s, lambda force: force > 1.3 * pressed)
        wait("the meter to show more", lambda: meter(s) > low)
        wait("the same in words", lambda: abs(float(s.described("Force meter").split()[0]) - s.log.last("hand")["force"]) < 0.06)
        s.hand.up()
        self.force(s, lambda force: force == 0)
        wait("the meter to fall", lambda: meter(s) == 0)
        # Beside the model there is nothing to press.
        s.hand.path(studio.along([s.pixel(0.5, 0.5), s.pixel(0.03, 0.95)], 60))
        s.hand.down()
        self.assertEqual(self.force(s, lambda force: True), 0)
        s.hand.up()
        self.assertEqual(s.log.since(0, "stroke"), [])
        self.assertEqual(relief("info", s.log.last("opened")["file"], "--json")["content_hash"], hash_before)
        self.assertTrue(s.close())


class TooFast(Case):
    """A recorded hand that presses, goes on within the solid, leaves it, and presses again. A device that is lost, and how
    many ticks a force goes on: safety_test.cpp, with a device that can fail."""

    AIR, SIDE = 100.0, 50.0  # x in model units, before the pumpkin and in its side
    WORDS = "The hand moved too fast; forces are off until you let go."

    def touched(self, name, *legs):
        """The recording of legs (x, ticks) that begin in the air, and its rows of force."""
        place, way = self.AIR, []
        for to, ticks in legs:
            way += [place + (to - place) * k / ticks for k in range(1, ticks + 1)]
            place = to
        path, forces, made = (studio.folder() / f"{name}.{kind}" for kind in ("path", "csv", "rlog"))
        path.write_text("t,x,y,z\n" + "".join(f"{k / 1000},{x},40,0\n" for k, x in enumerate(way)))
        relief("touch", self.file, "--path", path, "-o", forces, "--record", made)
        with open(forces) as written:
            return made, list(csv.DictReader(written))

    def test_only_the_jump_alarms(self):
        self.file = model()
        surface = next(float(row["x"]) for row in self.touched("probe", (self.SIDE, 1000))[1] if row["contact"] == "1")
        for name, ticks, alarms in (("slow", 100, 0), ("fast", 1, 1)):  # ms for 2 cm
            with self.subTest(name):
                made, _ = self.touched(name, (surface - 2, 400), (surface - 2, 200), (surface - 28, ticks), (surface - 28, 300),
                                       (surface + 10, 400), (surface - 2, 400), (surface - 2, 400))
                s = Studio(self.file, "--device", f"replay:{made}", ready=False)
                s.log.wait("toast", 0, lambda e: "has been played" in e["text"])
                told = s.log.since(0, "hand")
                self.assertGreater(max(e["force"] for e in told), 0)  # of moments that the log has caught
                self.assertEqual(told[-1]["kind"], "touching", "it is felt again")
                self.assertEqual([e["text"] for e in s.log.since(0, "banner")], [self.WORDS] * alarms)
                self.assertEqual([o.name for o in alerts(s)], [self.WORDS] * alarms)
                stopped = [e for e in told if e["kind"] == "no force"]
                self.assertEqual(bool(stopped), bool(alarms))
                for event in stopped:
                    self.assertEqual((event["cause"], event["force"], event["state"]), ("too fast", 0, self.WORDS))
                if alarms:
                    s.press("I have read it")
                    wait("the banner to go", lambda: not alerts(s))
                self.assertTrue(s.close())


if __name__ == "__main__":
    studio.main()
