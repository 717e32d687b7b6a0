"""Files: a scan that falls into the window, a conversion that is cancelled, files that are no good, a disk that is full."""

import math
import os
import pathlib
import time
import unittest

import studio
from studio import Case, DATA, SOAK, Studio, journal, measured, model, relief, scan, wait


def enabled(o):
    return o.getState().contains(studio.pyatspi.STATE_ENABLED)


def unnamed():
    """Models that the studio keeps for scans without a name yet."""
    return sorted((studio.folder() / "state" / "relief" / "unnamed").glob("*"))


def drop(s, file):
    """The file falls on what the window shows, the model or the start page; returns the mark of the log before it. A window
    that comes up is moved by the manager, so that a file may fall beside it: it falls again."""
    at = s.log.mark()

    def taken():
        shown = s.showing("Viewport") or s.showing("Start page")
        try:
            x, y, width, height = studio.rect(shown[0])
        except Exception:
            return False  # one page goes, the other comes
        return s.hand.drop(file, x + width // 2, y + height // 3)
    wait(f"the window to take {file}", taken, rest=0.1)
    return at


def closed_dialog(case, s, file):
    """The dialog that names the file goes by Escape; there is no other."""
    shown = lambda: [o.name + o.description for o in s.all(lambda o: o.getRoleName() in ("dialog", "alert") and studio.shows(o))]
    words = wait("the dialog", shown)
    wait("the dialog to close", lambda: s.dismissed() and not shown(), rest=0.2)  # first, so that one failure is not many
    case.assertEqual(len(words), 1, words)
    case.assertIn(file.name, words[0])
    wait("the model that was open before", lambda: not s.showing("Convert progress"))


class Scan(Case):
    """A scan that is dropped on the start page."""

    def dropped(self, triangles=400000):
        """A studio with its start page, on which the scan has fallen."""
        file = scan(triangles=triangles)
        s = Studio(ready=False)
        return s, drop(s, file)

    def test_01_mesh_at_once_then_slabs(self):
        for triangles in (400000, 1600000):  # so many that there is time to turn it, also where the machine is busy with others
            s, at = self.dropped(triangles)
            first = s.log.wait("frame", at, lambda e: e["rect"][2] > 0)
            measured(f"from the drop to the first picture of the mesh, {triangles} triangles",
                     f"{first['ms'] - s.log.since(at)[0]['ms']} ms", "400 ms for 400000")
            if self.turned(s, at):
                return
            self.assertTrue(s.close())
        self.fail("the slabs came before the mesh could be turned")

    def turned(self, s, at):
        """Turns the mesh and follows it to its slabs; False where they came first."""
        # It can be turned while its slabs are made; and what is seen then stays.
        mark = s.log.mark()
        s.drag((0.05, 0.5), (0.12, 0.5), button=2)
        s.log.wait("camera", mark)
        s.hands_off()
        s.settled(mark=mark)
        x, y, width, height = place = s.viewport()
        seen = x, y + round(0.14 * height), width, round(0.58 * height)  # between the ball of axes and the cards
        camera, mesh = s.log.last("camera"), s.picture(seen)
        shown = {o.name: enabled(o) for o in s.all(studio.shows)}
        if s.log.since(at, "opened"):
            return False
        self.assertFalse(shown["Carve"], "tools wait for the slabs")
        self.assertIn("Convert progress", shown)
        self.assertTrue(shown["Cancel"])
        opened = s.log.wait("opened", at, patience=3 * studio.PATIENCE)
        shares = [e["fraction"] for e in s.log.since(at, "convert")]
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(len(shares), 3)
        self.assertLessEqual(shares[-1], 1)
        wait("the tools", lambda: enabled(s.find("Carve")))
        mark = s.log.mark()
        s.settled(1)
        self.assertEqual([s.log.last("camera")[k] for k in ("eye", "target", "up")], [camera[k] for k in ("eye", "target", "up")])
        card = next((o for o in s.all(studio.shows) if "ertified" in o.name + o.description), None)
        self.assertIsNotNone(card, "the verdict")
        self.assertEqual(s.log.since(mark, "dialog"), [])
        self.assertEqual(relief("info", opened["file"], "--json")["content_hash"], opened["hash"])
        self.assertEqual(s.viewport(), place, "the picture jumps")
        error = mesh.squared_error(s.picture(seen))
        ratio = 10 * math.log10(255 ** 2 / max(error, 1e-9))
        measured("the slabs' picture against the mesh's", f"{ratio:.1f} dB", "40 dB")
        self.assertGreater(ratio, 40)
        self.assertTrue(s.close())
        return True

    def test_02_cancel_in_each_phase(self):
        # All phases in the long form, else about three of them, spread over the way. Two at least must hear it in time: the last
        # ones may be over before the press arrives.
        s, at = self.dropped(150000)
        s.log.wait("opened", at, patience=3 * studio.PATIENCE)
        phases = list(dict.fromkeys(e["phase"] for e in s.log.since(at, "convert")))
        self.assertTrue(s.close())
        kept = unnamed()
        self.assertGreater(len(phases), 2)
        cancelled = []
        for phase in phases if SOAK else phases[::max(1, len(phases) // 3)]:
            with self.subTest(phase):
                s, at = self.dropped(150000)
                cancel = s.find("Cancel")
                s.log.wait("convert", at, lambda e: e["phase"] == phase)
                pressed = time.monotonic()
                cancel.queryAction().doAction(0)
                end = wait("an end", lambda: next((e for e in s.log.since(at) if e["event"] in ("cancelled", "opened")), None),
                           3 * studio.PATIENCE)
                if end["event"] == "cancelled":
                    measured(f"from Cancel in {phase!r} to its answer", f"{time.monotonic() - pressed:.2f} s", "0.3 s")
                    cancelled.append(phase)
                    s.find("Start page")
                    wait("the progress to go", lambda: not s.showing("Convert progress"))
                    self.assertEqual(unnamed(), kept)
                else:
                    kept = unnamed()  # it was through before it heard
                self.assertTrue(s.close())
        self.assertGreaterEqual(len(cancelled), 2, "too fast to be cancelled")


@unittest.skipUnless(DATA.is_dir(), "skipped: no test data")
class BadFiles(Case):
    """Each is refused in one dialog that names it, or opens with its verdict; the program lives."""

    def test_bad_files(self):
        bad = sorted(p for p in (DATA / "b_bad").rglob("*") if p.suffix.lower() in (".ply", ".obj", ".stl", ".off"))
        small = [p for p in bad if p.stat().st_size < 200_000]
        chosen = bad if SOAK else small[::max(1, len(small) // 10)][:10]
        self.assertGreaterEqual(len(chosen), 10)
        s = Studio(ready=False)
        refused = 0
        for file in chosen:
            with self.subTest(str(file.relative_to(DATA))):
                at = drop(s, file)
                end = wait("a dialog or a model", lambda: next((e for e in s.log.since(at) if e["event"] in ("failed", "opened")), None),
                           3 * studio.PATIENCE)
                s.alive()
                if end["event"] == "failed":
                    refused += 1
                    closed_dialog(self, s, file)
                else:
                    self.assertTrue(s.log.wait("verdict", at)["title"])
                self.assertLessEqual(len(s.log.since(at, "failed")), 1)
        self.assertGreater(refused, 0)
        at = drop(s, scan())  # the control: a good one
        s.log.wait("opened", at, patience=3 * studio.PATIENCE)
        self.assertEqual(s.log.since(at, "failed"), [])
        self.assertTrue(s.close())


class WayBack(Case):
    """A file falls on a model that is open, and nothing comes of it: the model is there again, as it was."""

    def test_the_model_is_there_again(self):
        bad = studio.folder() / "no-mesh.ply"
        bad.write_text("this is no mesh")
        s = Studio(model())
        s.press("Carve")
        mark = s.log.mark()
        made = s.stroke((0.42, 0.45), (0.58, 0.5), samples=0)
        s.log.wait("saved", mark)
        mark = s.log.mark()
        s.drag((0.05, 0.5), (0.12, 0.5), button=2)
        s.log.wait("camera", mark)
        s.hands_off()
        s.settled(mark=mark, samples=4)
        camera = s.log.last("camera")
        for file, end in ((bad, "failed"), (scan(triangles=150000), "cancelled")):
            with self.subTest(end):
                at = drop(s, file)
                if end == "cancelled":
                    s.find("Cancel").queryAction().doAction(0)
                s.log.wait(end, at)
                if end == "failed":
                    closed_dialog(self, s, file)
                again = s.log.wait("opened", at, patience=3 * studio.PATIENCE)
                self.assertEqual((again["hash"], again["strokes"]), (made["hash"], 1))
                s.hands_off()
                back = lambda: [s.log.last("camera")[k] for k in ("eye", "target", "up")] == [camera[k] for k in ("eye", "target", "up")]
                wait("the camera to rest where it was", back, rest=0.2)
        mark = s.log.mark()
        s.press("Undo")
        self.assertEqual(s.log.wait("history", mark)["undo"], 0)
        self.assertTrue(s.close())


class FullDisk(Case):
    """The disk of the model is full: a banner, work goes on, nothing is lost."""

    def opened(self):
        """A model on a disk that is full while the flag is there."""
        self.flag = studio.folder() / "the-disk-is-full"
        self.addCleanup(lambda: self.flag.unlink(missing_ok=True))
        self.file = model()
        return Studio(self.file, environment={"LD_PRELOAD": str(studio.BIN / "libstudio_disk.so"), "RELIEF_TEST_FULL": str(self.flag)})

    def alerts(self, s):
        return [o for o in s.all(studio.shows) if o.getRoleName() == "alert"]

    def test_01_the_disk_has_room_again(self):
        s = self.opened()
        flag, file = self.flag, self.file
        s.press("Carve")
        mark = s.log.mark()
        s.stroke((0.42, 0.45), (0.46, 0.45))
        s.log.wait("saved", mark)
        flag.touch()
        mark = s.log.mark()
        second = s.stroke((0.48, 0.45), (0.52, 0.45))
        s.log.wait("banner", mark)
        self.assertEqual(len(journal(file)), 1)
        banner = wait("a banner of role alert", lambda: self.alerts(s))[0]
        self.assertIn("could not be saved yet", banner.name)
        wait("the same words in the status line", lambda: s.described("Status", "label") == banner.name)
        before = s.picture()
        third = s.stroke((0.42, 0.55), (0.46, 0.55))  # work goes on in memory
        self.assertGreater(before.differing(s.picture(), 8), 100)
        self.assertNotEqual(third["hash"], second["hash"])
        flag.unlink()
        s.log.wait("saved", mark, lambda e: e["stroke"] == 3, patience=15 + studio.PATIENCE)  # tried again every 10 s
        self.assertEqual(len(journal(file)), 3)
        self.assertEqual(relief("info", file, "--json")["content_hash"], third["hash"])
        wait("the banner to go", lambda: not self.alerts(s))
        self.assertTrue(s.close())

    def test_02_save_elsewhere(self):
        s = self.opened()
        s.press("Carve")
        mark = s.log.mark()
        s.stroke((0.42, 0.45), (0.46, 0.45), samples=0)
        s.log.wait("saved", mark)
        self.flag.touch()
        mark = s.log.mark()
        second = s.stroke((0.48, 0.45), (0.52, 0.45), samples=0)
        s.log.wait("banner", mark)
        place = studio.folder() / f"other-disk-{time.monotonic_ns()}"
        place.mkdir()
        there = place / "rescued.relief"
        s.click("Save elsewhere …", "push button")
        s.type_into("File name:", str(there))
        s.hand.keys("Return")
        self.assertEqual(s.log.wait("saved-elsewhere", mark)["file"], str(there))
        s.log.wait("saved", mark, lambda e: e["stroke"] == 2)
        self.assertEqual(len(journal(there)), 2)
        wait("the banner to go", lambda: not self.alerts(s))
        # Both strokes are there, and it goes on there; the full disk keeps what it had.
        mark = s.log.mark()
        third = s.stroke((0.42, 0.55), (0.46, 0.55), samples=0)
        s.log.wait("saved", mark, lambda e: e["stroke"] == 3)
        self.assertNotEqual(third["hash"], second["hash"])
        self.assertTrue(s.close())
        self.assertEqual((len(journal(there)), len(journal(self.file))), (3, 1))
        self.assertEqual(relief("info", there, "--json")["content_hash"], third["hash"])
        self.assertEqual([file.name for file in place.iterdir()], [there.name])


class Doors(Case):
    """The ways in beside a drop: the dialog, and the models of the last time."""

    def test_01_by_dialog_then_from_the_last_ones(self):
        file = model()
        s = Studio(ready=False)
        s.find("Start page")
        for ask, given in ((lambda: s.hand.keys("Control_L+o"), scan(triangles=2000)), (lambda: s.click("Choose a file", "push button"), file)):
            mark = s.log.mark()
            ask()
            s.type_into("File name:", str(given))
            s.hand.keys("Return")
            opened = s.log.wait("opened", mark, patience=3 * studio.PATIENCE)
            self.assertEqual(opened["strokes"], 0)
            s.hands_off()
            s.settled(mark=mark, samples=1)
            if given == file:
                s.press("Carve")
                made = s.stroke((0.42, 0.45), (0.58, 0.5), samples=0)
                s.log.wait("saved", mark)
            s.hand.keys("Control_L+w")
            s.find("Start page")
        self.assertEqual(opened["file"], str(file))
        mark = s.log.mark()
        self.assertRegex(s.described(file.stem, "push button"), r"\b1 stroke\b")
        s.click(file.stem, "push button")
        again = s.log.wait("opened", mark)
        self.assertEqual((again["file"], again["hash"], again["strokes"]), (str(file), made["hash"], 1))
        self.assertTrue(s.close())

    def test_02_a_name_that_is_not_there_is_told(self):
        s = Studio(model())
        before = s.log.last("opened")
        mark = s.log.mark()
        s.hand.keys("Control_L+o")
        s.type_into("File name:", str(studio.folder() / "nowhere.ply"))
        s.hand.keys("Return")
        wait("the dialog's own answer", lambda: len(s.dialogs()) > 1)
        wait("the dialogs to close", s.dismissed, rest=0.2)
        self.assertEqual(s.log.since(mark, "opened"), [])
        self.assertEqual(s.log.last("opened"), before)
        self.assertTrue(s.close())


if __name__ == "__main__":
    studio.main()
