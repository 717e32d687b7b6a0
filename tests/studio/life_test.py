"""From the first start to the last: the start page, a killed studio, an idle one, a hidden one."""

import os
import pathlib
import shutil
import signal
import threading
import time
import unittest

import studio
from studio import SOAK, Case, OneStudio, Studio, journal, measured, model, relief, steady, wait


def forget():
    """What earlier studios have left in the person's folders."""
    for name in ("config", "state", "data", "cache"):
        shutil.rmtree(studio.folder() / name, ignore_errors=True)
        (studio.folder() / name).mkdir(mode=0o700)
    studio.settings()


class FirstRun(Case):
    """From nothing to the first dent: three clicks, no dialog."""

    def test_sample_carve_dent(self):
        forget()
        begun = time.monotonic()
        s = Studio(ready=False)
        page = s.find("Start page")
        sample = next(iter(s.all(lambda o: "pumpkin" in o.name.lower() and o.getRoleName() != "label" and studio.shows(o), page)), None)
        self.assertIsNotNone(sample, "a sample on the start page")
        mark = s.log.mark()
        x, y, width, height = studio.rect(sample)
        s.hand.click(x + width // 2, y + height // 2)
        opened = s.log.wait("opened", mark, patience=4 * studio.PATIENCE)
        self.assertEqual(s.log.since(mark, "dialog"), [])
        s.hands_off()
        s.settled(mark=mark, samples=1)
        s.click("Carve")
        before = s.picture()
        made = s.stroke((0.45, 0.48), (0.55, 0.52), samples=1)
        measured("from the start to the first dent", f"{time.monotonic() - begun:.1f} s", "20 s")
        self.assertGreater(made["samples"], 0)
        self.assertGreater(before.differing(s.picture(), 16), 300)
        s.log.wait("saved", mark, lambda e: e["stroke"] == made["stroke"])
        file = pathlib.Path(opened["file"])
        self.assertEqual([stroke["tool"] for stroke in journal(file)], ["carve"])
        self.assertTrue(file.is_relative_to(studio.folder()))
        self.assertTrue(s.close())


class FirstPicture(Case):
    """A large model, from the start of the program."""

    def test_of_a_million_triangles(self):
        forget()
        s = Studio(model(intervals=71))  # 200 times 71 squared
        self.assertGreater(s.log.last("frame")["triangles"], 1_000_000)
        first = next(e for e in s.log.events if e["event"] == "frame" and e["rect"][2] > 0)
        measured(f"from the start to the first picture of a million triangles, {first['triangles']} of them drawn",
                 f"{s.before_log + first['ms']:.0f} ms", "1000 ms")
        self.assertTrue(s.close())


class Late(Case):
    """A window manager that lets the window wait: the model is open before the window is seen."""

    def test_the_picture_comes_with_the_window(self):
        forget()
        file = model()
        logs = lambda: [log.read_text() for log in studio.folder().glob("late-*.jsonl")]
        waited = []

        def manage_at_last():
            try:
                wait("a model behind a window that is not there", lambda: any('"opened"' in log for log in logs()))
                time.sleep(0.5)  # the time in which a picture would be asked for
                waited.extend(logs())
            finally:
                studio.manager(signal.SIGCONT)
        studio.manager(signal.SIGSTOP)
        late = threading.Thread(target=manage_at_last)
        late.start()
        s = Studio(file, name="late")  # its model is settled
        late.join()
        self.assertTrue(waited)
        self.assertFalse(any('"frame"' in log for log in waited), "the control: nothing is drawn before the window is there")
        self.assertTrue(s.close())


class Killed(Case):
    """kill -9 in the middle of the seventh stroke."""

    def recover_rows(self, s):
        page = s.find("Start page")
        return s.showing("Recover", root=page)

    def six_strokes(self, s):
        s.press("Carve")
        mark = s.log.mark()
        for k in range(6):
            made = s.stroke((0.42 + 0.03 * k, 0.45), (0.43 + 0.03 * k, 0.55), steps=20, samples=0)
        s.log.wait("saved", mark, lambda e: e["stroke"] == 6)
        return made

    def test_01_a_clean_end_has_nothing_to_recover(self):
        forget()
        s = Studio(model())
        self.six_strokes(s)
        self.assertTrue(s.close())
        s = Studio(ready=False)
        self.assertEqual(self.recover_rows(s), [])
        self.assertTrue(s.close())

    def test_02_six_strokes_are_kept(self):
        forget()
        file = model()
        s = Studio(file)
        sixth = self.six_strokes(s)
        x, y = s.pixel(0.45, 0.60)
        s.hand.at(x, y)
        s.hand.down()
        s.hand.path([(x + k, y) for k in range(1, 60)])
        s.kill()
        s.hand.up()
        self.assertEqual(len(journal(file)), 6)
        self.assertEqual(relief("info", file, "--json")["content_hash"], sixth["hash"])
        s = Studio(ready=False)
        rows = self.recover_rows(s)
        self.assertNotEqual(rows, [])
        self.assertRegex(rows[0].description, r"\b6 (finished )?strokes\b")
        mark = s.log.mark()
        x, y, width, height = studio.rect(rows[0])
        s.hand.click(x + width // 2, y + height // 2)
        self.assertEqual(s.log.wait("opened", mark)["hash"], sixth["hash"])
        s.hands_off()
        s.settled(mark=mark)
        mark = s.log.mark()
        s.press("Undo")
        s.log.wait("history", mark, lambda e: e["undo"] == 5)
        self.assertTrue(s.close())


class Saving(Case):
    """Save as, again and again, and given up: no stroke is lost, and no half file is left."""

    def setUp(self):
        super().setUp()
        forget()
        self.place = studio.folder() / f"saved-{time.monotonic_ns()}"
        self.place.mkdir()
        self.studio = self.start()
        self.strokes = 0

    def start(self):
        return Studio(model())

    def files(self):
        """All that lies beside the saved models; a model that is open has a journal of SQLite's beside it."""
        return sorted(file.name for file in self.place.iterdir() if not file.name.endswith(("-wal", "-shm", "-journal")))

    def stroke(self):
        s, mark = self.studio, self.studio.log.mark()
        s.press("Carve")
        at = 0.42 + 0.03 * self.strokes
        self.made = s.stroke((at, 0.45), (at + 0.01, 0.55), steps=20, samples=0)
        self.strokes += 1
        s.log.wait("saved", mark, lambda e: e["stroke"] == self.strokes)

    def dialog(self, name):
        """The file dialog, with the name typed into it."""
        s = self.studio
        s.hands_off()
        s.to_front()
        s.hand.keys("F3")
        s.find("Commands")
        s.hand.keys(*"save", "space", *"as", "Return")
        s.type_into("File name:", str(self.place / name))

    def save_as(self, name, replaced=False):
        """Where a file of that name is there, the dialog asks once more."""
        s, mark = self.studio, self.studio.log.mark()
        self.dialog(name)
        s.hand.keys("Return")
        if replaced:
            s.click("Yes", "push button")
        self.assertEqual(s.log.wait("saved-elsewhere", mark)["file"], str(self.place / name))
        wait("the dialogs to close", lambda: not s.dialogs())

    def holds(self, name, strokes, made):
        """The file is whole, and has so many strokes."""
        self.assertEqual(len(journal(self.place / name)), strokes)
        self.assertEqual(relief("info", self.place / name, "--json")["content_hash"], made["hash"])
        self.assertTrue(relief("verify", self.place / name, "--json")["holds"])

    def test_01_to_a_name_to_the_same_and_to_another(self):
        s = self.studio
        self.stroke()
        self.save_as("a.relief")
        self.stroke()
        mark = s.log.mark()
        self.dialog("a.relief")
        s.hand.keys("Return")
        s.click("Yes", "push button")
        s.log.wait("toast", mark, lambda e: "every finished stroke is in a.relief" in e["text"])
        self.holds("a.relief", 2, self.made)
        self.stroke()  # it goes on there
        self.holds("a.relief", 3, self.made)
        third = self.made
        self.save_as("b.relief")
        self.stroke()
        self.holds("b.relief", 4, self.made)
        self.holds("a.relief", 3, third)
        self.assertEqual(self.files(), ["a.relief", "b.relief"])
        self.assertTrue(s.close())
        self.holds("b.relief", 4, self.made)
        self.assertEqual(sorted(file.name for file in self.place.iterdir()), ["a.relief", "b.relief"])

    def test_02_over_a_file_that_another_model_had(self):
        other = self.place / "other.relief"
        shutil.copyfile(model(sample="torus"), other)
        self.stroke()
        self.save_as("other.relief", replaced=True)
        self.stroke()
        self.holds("other.relief", 2, self.made)
        self.assertTrue(self.studio.close())
        self.assertEqual(sorted(file.name for file in self.place.iterdir()), ["other.relief"])

    def test_03_two_in_a_row_without_a_stroke_between(self):
        self.stroke()
        self.save_as("a.relief")
        self.save_as("b.relief")
        self.save_as("a.relief", replaced=True)
        self.stroke()
        self.holds("a.relief", 2, self.made)
        self.assertEqual(len(journal(self.place / "b.relief")), 1)
        self.assertTrue(self.studio.close())
        self.assertEqual(sorted(file.name for file in self.place.iterdir()), ["a.relief", "b.relief"])

    def test_04_given_up_in_the_dialog(self):
        s = self.studio
        self.stroke()
        self.save_as("a.relief")
        mark = s.log.mark()
        self.dialog("never.relief")
        s.hand.keys("Escape")
        wait("the dialog to close", lambda: not s.dialogs())
        self.stroke()
        self.assertEqual(s.log.since(mark, "saved-elsewhere"), [])
        self.holds("a.relief", 2, self.made)
        self.assertTrue(s.close())
        self.assertEqual(sorted(file.name for file in self.place.iterdir()), ["a.relief"])


class CancelledSaving(Saving):
    """Cancel while another file is being written, to a disk that does not answer just then."""

    test_01_to_a_name_to_the_same_and_to_another = test_02_over_a_file_that_another_model_had = None
    test_03_two_in_a_row_without_a_stroke_between = test_04_given_up_in_the_dialog = None

    def start(self):
        self.slow = studio.folder() / "the-disk-is-slow"
        return Studio(model(), environment={"LD_PRELOAD": str(studio.BIN / "libstudio_disk.so"), "RELIEF_TEST_SLOW": str(self.slow)})

    def tearDown(self):
        self.slow.unlink(missing_ok=True)
        super().tearDown()

    def being_written(self, name):
        """Save as, over a file that is there, has begun and gets no further; the mark of the log before it."""
        s, mark = self.studio, self.studio.log.mark()
        self.dialog(name)
        self.slow.touch()
        s.hand.keys("Return")
        s.click("Yes", "push button")
        wait("the dialogs to close", lambda: not s.dialogs())
        s.find("Convert progress")
        wait("a file that is being written", lambda: len(self.files()) > 2)
        return mark

    def test_the_old_files_stay(self):
        s = self.studio
        shutil.copyfile(model(sample="torus"), self.place / "other.relief")
        other = (self.place / "other.relief").read_bytes()
        self.stroke()
        self.save_as("a.relief")
        mark = self.being_written("other.relief")
        s.press("Carve")
        self.made = s.stroke((0.45, 0.45), (0.46, 0.55), steps=20, samples=0)  # work goes on meanwhile
        s.press("Cancel", "push button")
        wait("the answer to Cancel", lambda: s.described("Convert progress").startswith("Stopping"))
        self.slow.unlink()
        told = s.log.wait("toast", mark, lambda e: "ancelled" in e["text"])["text"]
        self.assertEqual(told, "Cancelled: nothing was written. The model goes on in a.relief.")
        self.assertEqual(s.described("Status", "label"), told)
        wait("the progress to go", lambda: not s.showing("Convert progress"))
        self.assertEqual(s.log.since(mark, "saved-elsewhere") + s.log.since(mark, "banner") + s.log.since(mark, "failed"), [])
        self.assertEqual(self.files(), ["a.relief", "other.relief"])
        self.assertEqual((self.place / "other.relief").read_bytes(), other)
        s.log.wait("saved", mark, lambda e: e["stroke"] == 2)
        self.holds("a.relief", 2, self.made)
        # The control: the same without a Cancel.
        mark = self.being_written("other.relief")
        self.slow.unlink()
        s.log.wait("saved-elsewhere", mark)
        self.strokes = 2
        self.stroke()
        self.holds("other.relief", 3, self.made)
        self.assertEqual(len(journal(self.place / "a.relief")), 2)
        self.assertTrue(s.close())
        self.assertEqual(sorted(file.name for file in self.place.iterdir()), ["a.relief", "other.relief"])


class Fault(Case):
    """A studio that ends by a fault says where."""

    @unittest.skipIf(studio.SANITIZED, "a sanitizer has a report of its own")
    def test_the_calls_that_led_there_are_told(self):
        forget()
        s = Studio(model())
        os.kill(s.pid, signal.SIGSEGV)
        self.assertEqual(s.process.wait(studio.PATIENCE), -signal.SIGSEGV)
        with self.assertRaisesRegex(AssertionError, r"(?s)ended with SIGSEGV.*the calls that led there:.*relief-studio\("):
            s.alive()


def processor_ticks(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def switches(pid):
    total = 0
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        total += sum(int(line.split()[1]) for line in (task / "status").read_text().splitlines() if "ctxt_switches" in line)
    return total


class Idle(OneStudio):
    """A studio in which nothing happens does nothing."""

    def test_01_ten_seconds_of_nothing(self):
        s = self.studio
        s.press("Carve")
        s.stroke((0.45, 0.5), (0.55, 0.5))
        steady(lambda: (s.log.mark(), s.picture(s.viewport()).words), 4)  # toasts go, the saver ends: then nothing at all
        mark, ticks, switched, begun = s.log.mark(), processor_ticks(s.pid), switches(s.pid), time.monotonic()
        before = s.picture(s.viewport())
        time.sleep(10)  # the thing that is measured
        self.assertEqual(s.log.since(mark), [])
        self.assertEqual(s.picture(s.viewport()), before)
        share = (processor_ticks(s.pid) - ticks) / os.sysconf("SC_CLK_TCK") / (time.monotonic() - begun)
        measured("processor while idle", f"{100 * share:.2f} %, {switches(s.pid) - switched} context switches in 10 s", "0.5 %, 0")

    def test_02_the_ring_draws_no_frame_but_the_camera_does(self):
        s = self.studio
        s.hand.at(*s.pixel(0.4, 0.5))
        s.settled()
        mark = s.log.mark()
        s.hand.path(studio.along([s.pixel(0.4, 0.5), s.pixel(0.6, 0.5)], 100), 100)
        self.assertEqual(s.log.since(mark, "frame"), [])
        s.drag((0.4, 0.5), (0.6, 0.5), button=2)
        s.settled(mark=mark)
        self.assertGreater(len(s.log.since(mark, "frame")), 3)

    def test_03_a_hidden_window_draws_nothing(self):
        s = self.studio
        s.hands_off()
        s.settled()
        undo = s.find("Undo")
        mark = s.log.mark()
        s.window("windowminimize")
        wait("the window to be hidden", lambda: not s.windows())
        undo.queryAction().doAction(0)
        head = s.log.wait("history", mark)
        time.sleep(1)  # the time in which a frame would come
        self.assertEqual(s.log.since(mark, "frame"), [])
        s.to_front()
        self.assertGreaterEqual(s.settled(mark=mark)["revision"], head.get("revision", 0))


class Leaks(Case):
    """Open, carve, close, again and again: what a model needs is given back."""

    ROUNDS = 50 if SOAK else 8

    def test_open_carve_close(self):
        file = model()
        s = Studio(file)
        counts, sizes = [], []
        for k in range(self.ROUNDS):
            s.press("Carve")
            made = s.stroke((0.42 + 0.001 * k, 0.45), (0.5, 0.5), steps=20, samples=1)
            self.assertGreater(made["stroke"], 0)
            mark = s.log.mark()
            s.hand.at(*s.pixel(0.5, 0.02))
            s.hand.keys("Control_L+w")
            page = s.find("Start page")
            counts.append(steady(lambda: (len(os.listdir(f"/proc/{s.pid}/fd")), len(os.listdir(f"/proc/{s.pid}/task")))))
            sizes.append(int(pathlib.Path(f"/proc/{s.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20)
            s.hand.drop(file, *(studio.rect(page)[k] + studio.rect(page)[k + 2] // 2 for k in (0, 1)))
            s.log.wait("opened", mark)
            s.settled(mark=mark, samples=1)
        measured("files and threads, MiB after each closing", f"{counts[4]} to {counts[-1]}, {sizes[4]:.0f} to {sizes[-1]:.0f}", "2 % more at most")
        self.assertEqual(counts[-1], counts[4])
        self.assertTrue(s.close())


if __name__ == "__main__":
    studio.main()
