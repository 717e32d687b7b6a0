"""Sculpting by mouse and key: carve, every tool, radius and strength, undo, replay, symmetry, colour."""

import contextlib
import json
import math
import re
import sqlite3
import unittest

import studio
from picture import channels
from studio import Case, OneStudio, Studio, checked, journal, measured, model, relief, steady, wait

ACROSS = ((0.42, 0.45), (0.58, 0.52))  # a stroke over the middle of the model


def hash_of(file):
    """Asked again where the studio writes the file meanwhile."""
    def asked():
        try:
            return relief("info", file, "--json")["content_hash"]
        except AssertionError as e:
            if "was changed by another program" not in str(e):
                raise
            return None
    return wait("a file at rest", asked)


def number(text):
    """The first number in a text: 8.5 of "8.5 mm"."""
    found = re.search(r"-?\d+(?:[.,]\d+)?", text)
    assert found, f"no number in {text!r}"
    return float(found.group().replace(",", "."))


class Carve(OneStudio):
    """One stroke, seen on the screen, in the log and in the file."""

    def test_01_a_way_without_a_press_changes_nothing(self):
        s = self.studio
        s.press("Carve")
        s.hands_off()
        s.settled()
        before, mark, hash_before = s.picture(), s.log.mark(), hash_of(self.file)
        s.hand.path(studio.along([s.pixel(*p) for p in ACROSS], 60))
        s.hands_off()
        wait("the ring to go", lambda: s.picture() == before)
        self.assertEqual(s.log.since(mark, "stroke"), [])
        self.assertEqual(hash_of(self.file), hash_before)
        self.assertEqual(journal(self.file), [])

    def test_02_carve_one_dent(self):
        s = self.studio
        opened = s.log.last("opened")
        self.assertEqual(opened["hash"], hash_of(self.file))
        s.press("Carve")
        s.hands_off()
        s.settled()
        before, mark, revision = s.picture(), s.log.mark(), s.log.last("frame")["revision"]
        made = s.stroke(*ACROSS)
        self.assertEqual(made["tool"], "carve")
        self.assertGreater(made["samples"], 100)
        self.assertGreater(made["revision"], revision)
        after = s.picture()
        self.assertGreater(before.differing(after, 8), 500)
        x, y, width, height = before.difference_box(after, 8)
        for point in ACROSS:
            px, py = s.pixel(*point)
            self.assertTrue(x - 3 <= px <= x + width + 3 and y - 3 <= py <= y + height + 3, (point, (x, y, width, height)))
        s.log.wait("saved", mark, lambda e: e["stroke"] == 1)
        self.assertEqual(hash_of(self.file), made["hash"])
        self.assertEqual([stroke["tool"] for stroke in journal(self.file)], ["carve"])

    def test_03_a_clean_end_leaves_all_in_the_file(self):
        hash_before = self.studio.log.last("stroke")["hash"]
        self.assertTrue(self.studio.close(), self.studio.said())
        self.assertIsNotNone(self.studio.log.last("exit"))
        self.assertEqual(hash_of(self.file), hash_before)


class Again(Case):
    """The last stroke once more, and the next day's first: with the tool of the day before."""

    def test_a_stroke_is_repeated_and_the_tool_is_kept(self):
        file = model()
        s = Studio(file)
        mark = s.log.mark()
        s.hand.keys("Shift_L+r")
        self.assertIn("no stroke", s.log.wait("toast", mark)["text"])
        s.press("Inflate")
        s.hand.at(*s.pixel(0.5, 0.5))
        s.hand.keys("bracketright", "bracketright")
        s.log.wait("setting", mark, lambda e: e["id"] == "radius")
        first = s.stroke(*ACROSS, samples=0)
        mark = s.log.mark()
        s.hand.keys("Shift_L+r")
        second = s.log.wait("stroke", mark)
        self.assertNotEqual(second["hash"], first["hash"])
        # On the surface of now, which has come nearer: the same way on the screen, at the same times.
        s.log.wait("saved", mark, lambda e: e["stroke"] == 2)
        a, b = journal(file)
        self.assertEqual([p[0] for p in a["points"]], [p[0] for p in b["points"]])
        self.assertNotEqual(a["points"], b["points"])
        self.assertLess(max(math.dist(p[1:4], q[1:4]) for p, q in zip(a["points"], b["points"])), 2 * a["radius"])
        self.assertEqual({k: v for k, v in a.items() if k != "points"}, {k: v for k, v in b.items() if k != "points"})
        radius, mark = number(s.described("Radius")), s.log.mark()
        s.press("sea blue")
        wait("sea blue in the hand", lambda: s.described("Colours") == "sea blue")
        s.stroke(*ACROSS, samples=0)
        s.log.wait("saved", mark)
        kept = lambda: "colour=#35627f" in (studio.folder() / "config" / "relief" / "studio.conf").read_text()
        wait("the settings in their file", kept)
        s.kill()
        s = Studio(file, same_tools=True)
        self.assertTrue(checked(s.find("Inflate")))
        self.assertAlmostEqual(number(s.described("Radius")), radius, delta=0.01 * radius)
        self.assertEqual(s.described("Colours"), "sea blue")
        self.assertTrue(s.close())
        s = Studio(file)  # the control: one that is told nothing
        self.assertTrue(checked(s.find("Carve")))
        self.assertTrue(s.close())


class Tools(OneStudio):
    """Every tool by name and by key; radius and strength in all their ways."""

    TITLES = ("Carve", "Deposit", "Paint", "Smooth", "Flatten", "Inflate", "Clay", "Layer")
    KEYS = {"Touch": "t", "Carve": "c", "Deposit": "d", "Paint": "b", "Smooth": "s", "Flatten": "Shift_L+t", "Inflate": "i",
            "Clay": "Shift_L+d", "Layer": "l", "Mask": "m", "Unmask": "Shift_L+m"}

    def setUp(self):
        super().setUp()
        self.undo_all()

    def undo_all(self):
        """The model as it was opened."""
        s = self.studio
        while (s.log.last("history") or {"undo": 0})["undo"] > 0:
            mark, left = s.log.mark(), s.log.last("history")["undo"]
            s.press("Undo")
            s.log.wait("history", mark, lambda e: e["undo"] < left)

    def undone(self, to):
        """One step back, to the head of that hash."""
        mark = self.studio.log.mark()
        self.studio.press("Undo")
        self.assertEqual(self.studio.log.wait("history", mark)["hash"], to)

    def chosen(self, title):
        s = self.studio
        if not checked(s.find(title)):
            mark = s.log.mark()
            s.press(title)
            self.assertEqual(s.log.wait("tool", mark)["id"], title.lower())
        wait(f"{title} to be checked", lambda: checked(s.find(title)))

    def test_01_every_tool_by_name(self):
        s = self.studio
        self.chosen("Carve")
        rough = s.stroke((0.42, 0.40), (0.58, 0.40), (0.42, 0.44), samples=1)["hash"]  # that smooth and flatten have something to do
        way = (0.43, 0.41), (0.57, 0.43)
        area = s.around(*way)
        before, pictures = s.picture(area), {}
        for title in self.TITLES:
            with self.subTest(title):
                self.chosen(title)
                made = s.stroke(*way, samples=1)
                self.assertEqual(made["tool"], title.lower())
                self.assertGreater(made["samples"], 0)
                self.assertNotEqual(made["hash"], rough)
                pictures[title] = s.picture(area)
                self.assertGreater(before.differing(pictures[title], 8), 50)
                self.undone(rough)
        self.masked_and_not(way, area, rough)
        for a, b in (("Carve", "Deposit"), ("Paint", "Deposit"), ("Smooth", "Deposit")):
            self.assertGreater(pictures[a].differing(pictures[b], 12), 100, (a, b))

    def masked_and_not(self, way, area, rough):
        """Mask is seen, Unmask takes it away, and Touch changes nothing at all."""
        s = self.studio
        bare = s.picture(area)
        self.chosen("Mask")
        masked = s.stroke(*way)["hash"]
        covered = s.picture(area)
        self.assertGreater(bare.differing(covered, 8), 50)
        self.chosen("Unmask")
        cleared = s.stroke(*way)
        self.assertEqual(cleared["tool"], "unmask")
        self.assertNotIn(cleared["hash"], (rough, masked))
        uncovered = s.picture(area)
        self.assertGreater(covered.differing(uncovered, 8), 50)
        # How much a pass at half strength takes away goes by its time.
        self.assertLess(bare.squared_error(uncovered), 0.8 * bare.squared_error(covered))
        self.chosen("Touch")
        mark = s.log.mark()
        s.drag(*way)
        self.chosen("Carve")  # what comes next is told, so that we know when to look
        s.hands_off()
        wait("the picture as it was", lambda: s.picture(area) == uncovered)
        self.assertEqual(s.log.since(mark, "stroke") + s.log.since(mark, "history"), [])
        self.undone(masked)
        self.undone(rough)

    def test_02_a_masked_place_stays(self):
        s = self.studio
        way = (0.49, 0.48), (0.51, 0.48)
        area = s.around(*way, margin=20)
        self.set_bar("Radius", 0.9)
        self.chosen("Mask")
        self.set_bar("Strength", 1.0)
        s.stroke((0.46, 0.48), (0.54, 0.48), (0.46, 0.49), (0.54, 0.47), hertz=100, steps=200)
        masked = s.picture(area)
        self.set_bar("Radius", 0.35)
        self.chosen("Carve")
        kept = s.stroke(*way)
        self.assertEqual((kept["samples"], kept["changed"]), (0, False))
        wait("the masked place as it was", lambda: s.picture(area) == masked)
        self.undo_all()
        s.hands_off()
        s.settled()
        bare = s.picture(area)
        self.assertGreater(bare.differing(masked, 8), 1000, "a mask is seen")
        cut = s.stroke(*way)  # the control: without the mask it is cut
        self.assertGreater(bare.differing(s.picture(area), 8), 100)
        self.assertGreater(cut["samples"], 0)

    def by_key(self, title):
        mark = self.studio.log.mark()
        self.studio.hand.keys(self.KEYS[title])
        self.assertEqual(self.studio.log.wait("tool", mark)["id"], title.lower())
        wait(f"{title} to be checked", lambda: checked(self.studio.find(title)))

    def dab(self):
        """The event of a dab where the pointer is. It has no times of a hand's, so it is the same whenever it is made."""
        mark = self.studio.log.mark()
        self.studio.hand.keys("Return")
        made = self.studio.log.wait("stroke", mark)
        self.studio.log.wait("history", mark, lambda e: e["hash"] == made["hash"])
        return made

    def test_03_every_tool_by_key(self):
        s = self.studio
        column = {o.name for o in s.all(lambda o: o.getRoleName() == "check box" and studio.shows(o), s.find("Tools", "tool bar"))}
        self.assertEqual(column, set(self.KEYS))
        self.chosen("Carve")
        s.hand.at(*s.pixel(0.5, 0.5))
        self.dab()  # that smooth and flatten have something to do
        self.chosen("Mask")
        s.hand.at(*s.pixel(0.51, 0.5))
        rough = self.dab()["hash"]  # and unmask
        hashes = set()
        for title in self.KEYS:
            with self.subTest(title):
                if title == "Touch":
                    self.by_key(title)
                    mark = s.log.mark()
                    s.hand.keys("Return")
                    self.chosen("Carve")
                    self.assertEqual(s.log.since(mark, "stroke"), [], "Touch leaves no trace")
                    continue
                self.chosen(title)
                by_name = self.dab()
                self.assertEqual(by_name["tool"], title.lower())
                self.assertGreater(by_name["samples"], 0)
                self.assertNotEqual(by_name["hash"], rough)
                self.undone(rough)
                self.chosen("Paint" if title == "Carve" else "Carve")
                self.by_key(title)
                by_key = self.dab()
                self.assertEqual((by_key["tool"], by_key["samples"], by_key["hash"]), (by_name["tool"], by_name["samples"], by_name["hash"]))
                self.undone(rough)
                hashes.add(by_key["hash"])
        self.assertEqual(len(hashes), len(self.KEYS) - 1, "each tool does something else")

    def test_04_a_key_in_a_text_field_is_text(self):
        s = self.studio
        self.chosen("Carve")
        x, y, width, height = studio.rect(s.find("Radius"))

        def type_a_radius():
            s.hand.click(x + width // 2, y + height // 2)
            s.hand.click(x + width // 2, y + height // 2)
        for open_it, below in ((lambda: s.hand.keys("F3"), "Commands"), (type_a_radius, "Top bar")):
            with self.subTest(below):
                mark = s.log.mark()
                s.hand.at(*s.pixel(0.5, 0.5))
                open_it()
                field = wait("a text field", lambda: next(s.all(lambda o: o.getRoleName() == "text" and studio.shows(o), s.find(below)), None))
                s.hand.keys("Control_L+a", "b", "d", "l")
                wait("the text", lambda: field.queryText().getText(0, -1) == "bdl")
                s.hand.keys("Escape")
                wait("the field to go", lambda: not list(s.all(lambda o: o.getRoleName() == "text" and studio.shows(o))))
                self.assertEqual(s.log.since(mark, "tool"), [])
                s.hand.at(*s.pixel(0.5, 0.5))
                s.hand.keys("b")  # the control: the keys are the viewport's again
                self.assertEqual(s.log.wait("tool", mark)["id"], "paint")
                self.chosen("Carve")

    # ---- radius and strength

    def set_bar(self, name, share):
        """Through the accessible value; what the description then says."""
        value = self.studio.find(name).queryValue()
        value.currentValue = value.minimumValue + share * (value.maximumValue - value.minimumValue)
        wait(f"{name} at {share}", lambda: abs(value.currentValue - value.minimumValue -
                                               share * (value.maximumValue - value.minimumValue)) <= 1)
        return number(self.studio.described(name))

    def setting(self, mark, name="radius", ok=lambda value: True):
        """The value of a setting that was changed since the mark and came to where it should, once it stands."""
        self.studio.log.wait("setting", mark, lambda e: e["id"] == name and ok(e["value"]))
        return steady(lambda: [e for e in self.studio.log.since(mark, "setting") if e["id"] == name][-1]["value"])

    def ring(self):
        """Places of the pixels that are painted over the picture around the pointer, from the middle of the ring, and its half
        width and height."""
        s = self.studio
        s.hands_off()
        s.settled()
        x, y = s.pixel(0.5, 0.5)
        steady(lambda: s.picture((x - 100, y - 100, 200, 200)).words)  # the ring goes
        without = s.picture()
        self.assertIsNotNone(s.hand.changes((x - 250, y - 200, 500, 400), lambda: s.hand.at(x, y)))
        left, top, width, height = wait("the ring", lambda: without.difference_box(s.picture(), 8))
        area = left, top, width, height
        return without.crop(area).places(s.picture(area), 8), (left + width / 2, top + height / 2), (width / 2, height / 2)

    def ring_width(self):
        """Pixels."""
        return 2 * self.ring()[2][0]

    def inner_ring(self):
        """The width of the dotted ring, which is the strength, in the rows of its middle: pixels. The outer one, with its dark
        border, is left out: it is 6 pixels wide."""
        places, (middle, height), (wide, high) = self.ring()
        xs = [x for x, y in places if abs(y - height) <= 4 and math.hypot((x - middle) / wide, (y - height) / high) < 1 - 6 / wide]
        return max(xs) - min(xs)

    def test_05_radius_by_bar_key_and_hand(self):
        s = self.studio
        self.chosen("Carve")
        self.set_bar("Radius", 0.5)
        mark = s.log.mark()
        narrow = self.set_bar("Radius", 0.4)
        self.assertAlmostEqual(self.setting(mark), narrow, delta=0.01 * narrow)
        narrow_ring = self.ring_width()
        mark = s.log.mark()
        wide = self.set_bar("Radius", 0.6)
        self.assertAlmostEqual(self.setting(mark), wide, delta=0.01 * wide)
        self.assertAlmostEqual(self.ring_width() / narrow_ring, wide / narrow, delta=0.15 * wide / narrow)
        for key, factor in (("bracketright", 1.1), ("bracketleft", 1 / 1.1)):
            before, mark = number(s.described("Radius")), s.log.mark()
            s.hand.keys(key)
            self.assertAlmostEqual(self.setting(mark) / before, factor, delta=0.015)
        # F, a way to the right, a click; then F, a way, Esc.
        x, y = s.pixel(0.5, 0.5)
        before, mark = number(s.described("Radius")), s.log.mark()
        s.hand.at(x, y)
        s.hand.keys("f")
        s.hand.path([(x + k, y) for k in range(1, 40)])
        s.hand.down()
        s.hand.up()
        grown = self.setting(mark, ok=lambda value: value > 1.2 * before)
        self.assertEqual(s.log.since(mark, "stroke"), [])
        mark = s.log.mark()
        s.hand.at(x, y)
        s.hand.keys("f")
        s.hand.path([(x + k, y) for k in range(1, 40)])
        self.setting(mark, ok=lambda value: value > 1.2 * grown)
        s.hand.keys("Escape")
        wait("the old radius", lambda: abs(self.setting(mark) - grown) <= 0.01 * grown)
        # The key held while the hand goes, with a button and without: its release keeps what was set.
        for button in (None, 1):
            before, mark = number(s.described("Radius")), s.log.mark()
            s.hand.at(x, y)
            s.hand.hold_key("f")
            if button:
                s.hand.down()
            s.hand.path([(x - k, y) for k in range(1, 20)])
            smaller = self.setting(mark, ok=lambda value: value < 0.9 * before)
            if button:
                s.hand.up()
            s.hand.release_key("f")
            s.hand.path([(x - k, y) for k in range(20, 60)])
            self.assertAlmostEqual(self.setting(mark), smaller, delta=0.05 * before)
            self.assertEqual(s.log.since(mark, "stroke"), [])
        # The mouse on the bar itself.
        left, top, width, height = studio.rect(s.find("Radius"))
        mark = s.log.mark()
        s.hand.click(left + width // 4, top + height // 2)
        low = self.setting(mark)
        mark = s.log.mark()
        s.hand.at(left + width // 4, top + height // 2)
        s.hand.down()
        s.hand.path([(left + width // 4 + k, top + height // 2) for k in range(1, width // 4)])
        s.hand.up()
        self.setting(mark, ok=lambda value: value > 1.2 * low)

    def test_06_strength_by_bar_and_hand(self):
        s = self.studio
        self.chosen("Carve")
        self.set_bar("Radius", 0.5)
        self.set_bar("Strength", 0.5)
        samples = {}
        for share in (0.3, 0.8):
            mark = s.log.mark()
            self.assertAlmostEqual(self.set_bar("Strength", share), 100 * share, delta=1)
            self.assertAlmostEqual(self.setting(mark, "strength"), share, delta=0.01)
            samples[share] = s.stroke(*ACROSS, samples=0)["samples"]
            self.undo_all()
        self.assertGreater(samples[0.8], 1.2 * samples[0.3])  # a ball that sinks deeper cuts wider
        self.set_bar("Radius", 0.7)
        shown = {}
        for share in samples:
            self.set_bar("Strength", share)
            shown[share] = self.inner_ring()
        self.assertAlmostEqual(shown[0.8] / shown[0.3], 0.8 / 0.3, delta=0.15 * 0.8 / 0.3)
        x, y = s.pixel(0.5, 0.5)
        self.set_bar("Strength", 0.5)
        for end, kept in (("Return", True), ("Escape", False)):
            before, mark = number(s.described("Strength")) / 100, s.log.mark()
            s.hand.at(x, y)
            s.hand.keys("Shift_L+f")
            s.hand.path([(x + k, y) for k in range(1, 40)])
            dragged = self.setting(mark, "strength", ok=lambda value: value > 1.1 * before)
            s.hand.keys(end)
            wanted = dragged if kept else before
            wait(f"the strength after {end}", lambda: abs(number(s.described("Strength")) / 100 - wanted) <= 0.01)
            self.assertAlmostEqual(self.setting(mark, "strength"), wanted, delta=0.01)
        self.assertEqual(s.log.since(mark, "stroke"), [])


class Limits(OneStudio):
    """Where clay ends: it is said why while the stroke goes, room is made, and the model stays whole."""

    def carved(self, u, v):
        """A press in one place: the stroke, and what was said meanwhile."""
        s, mark = self.studio, self.studio.log.mark()
        made = s.stroke((u, v), (u + 0.005, v + 0.005), steps=8, samples=0)
        return made, [e["text"] for e in s.log.since(mark, "toast")]

    def test_a_hole_deeper_than_the_clay(self):
        s = self.studio
        s.press("Carve")
        made, told = self.carved(0.40, 0.45)  # the control: with the usual tool there is clay
        self.assertEqual((made["limited"], [words for words in told if "oom" in words or "ends here" in words]), (0, []))
        for name, share in (("Radius", 0.75), ("Strength", 1)):
            value = s.find(name).queryValue()
            value.currentValue = value.minimumValue + share * (value.maximumValue - value.minimumValue)
        all_told, limited = [], 0
        for _ in range(8):
            made, told = self.carved(0.5, 0.42)
            all_told += told
            limited = max(limited, made["limited"])
            if limited:
                break
        self.assertGreater(limited, 0, "the pumpkin is no deeper than eight radii")
        self.assertTrue(any(words.startswith("Making room under the stroke") for words in all_told), all_told)
        why = [words for words in told if words.startswith(("The form is ", "The tool goes ", "The clay ends at "))]
        self.assertTrue(why, told)
        self.assertEqual(told[-1], why[-1], "the reason is what stays to be read")
        self.assertRegex(why[-1], r"\(-?[\d.]+, -?[\d.]+, -?[\d.]+\)\xa0mm", "and the place")
        # It is read on the screen, by a screen reader, and in the status line.
        self.assertEqual(s.described("Status", "label"), why[-1])
        area = studio.rect(s.find(why[-1], "notification"))
        seen = s.picture(area)
        wait("the words to go", lambda: not s.showing(why[-1], "notification"), rest=0.1)
        self.assertGreater(seen.differing(s.picture(area), 24), 200)
        s.log.wait("saved", 0, lambda e: e["stroke"] == made["stroke"])
        self.assertTrue(relief("verify", self.file, "--json")["holds"])


class History(OneStudio):
    """Undo and redo, twenty deep; what was done can be replayed."""

    STROKES = 20

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.original = model()
        cls.studio.press("Carve")

    def step(self, act, hash_wanted):
        mark = self.studio.log.mark()
        act()
        self.assertEqual(self.studio.log.wait("history", mark)["hash"], hash_wanted)

    def test_01_twenty_steps_there_and_back(self):
        s = self.studio
        s.hands_off()
        s.settled()
        hashes, pictures = [s.log.last("opened")["hash"]], {0: s.picture()}
        for k in range(self.STROKES):
            row, column = divmod(k, 5)
            u, v = 0.40 + 0.045 * column, 0.38 + 0.06 * row
            last = k + 1 in (10, self.STROKES)
            hashes.append(s.stroke((u, v), (u + 0.02, v + 0.02), steps=20, samples=None if last else 0)["hash"])
            if last:
                pictures[k + 1] = s.picture()
        self.assertEqual(len(set(hashes)), self.STROKES + 1)
        viewport = s.pixel(0.5, 0.02)
        undo_key, redo_key = lambda: s.hand.keys("Control_L+z"), lambda: s.hand.keys("Control_L+Shift_L+z")
        undo_button, redo_button = lambda: s.press("Undo"), lambda: s.press("Redo")
        for undo, redo in ((undo_key, redo_key), (undo_button, redo_button)):
            s.hand.at(*viewport)
            for way, ends in ((range(self.STROKES - 1, -1, -1), 0), (range(1, self.STROKES + 1), self.STROKES)):
                act = undo if ends == 0 else redo
                for k in way:
                    self.step(act, hashes[k])
                    if k in pictures:
                        s.hands_off()
                        s.settled()
                        wait(f"the picture of step {k}", lambda: s.picture() == pictures[k])
                        s.hand.at(*viewport)
        wait("the last step in the file", lambda: hash_of(self.file) == hashes[-1])
        # The rows of the history.
        rows = [o for o in s.all(lambda o: o.getRoleName() == "list item", s.find("History panel"))]
        self.assertEqual(len(rows), self.STROKES + 1)
        x, y, width, height = studio.rect(s.find("History"))
        clicked, row = next((k, studio.rect(o)) for k, o in enumerate(rows[:-1]) if y < studio.rect(o)[1] + 10 < y + height - 10)
        self.step(lambda: s.hand.click(x + width // 2, row[1] + 10), hashes[clicked])
        for key, count, k in (("Up", clicked, 0), ("Down", 7, 7), ("Down", self.STROKES - 7, self.STROKES)):
            self.step(lambda: s.hand.keys(*[key] * count, "Return"), hashes[k])
        wait("the last step in the file", lambda: hash_of(self.file) == hashes[-1])

    def test_02_redo_is_gone_after_a_new_stroke(self):
        s = self.studio
        mark = s.log.mark()
        s.press("Undo")
        self.assertGreaterEqual(s.log.wait("history", mark)["redo"], 1)
        made = s.stroke((0.40, 0.62), (0.42, 0.62))
        wait("no redo", lambda: s.log.last("history")["redo"] == 0)
        mark = s.log.mark()
        s.hand.at(*s.pixel(0.5, 0.02))
        s.hand.keys("Control_L+Shift_L+z")
        s.hand.keys("Control_L+z")  # one that does something, so that we know when to look
        s.log.wait("history", mark)
        self.assertEqual(s.log.last("history")["redo"], 1)
        s.hand.keys("Control_L+Shift_L+z")
        self.assertEqual(s.log.wait("history", mark, lambda e: e["redo"] == 0)["hash"], made["hash"])

    def test_03_the_same_strokes_by_the_command_line(self):
        s = self.studio
        s.press("Deposit")
        mark = s.log.mark()
        s.stroke((0.45, 0.60), (0.55, 0.60), hertz=500, samples=0)
        s.press("Paint")
        head = s.stroke((0.45, 0.40), (0.55, 0.45), hertz=500, samples=0)
        s.log.wait("saved", mark, lambda e: e["stroke"] == head["stroke"])
        strokes = journal(self.file)
        self.assertEqual(self.replayed(strokes), head["hash"])
        # The control: one point moved by a hundredth of the radius.
        moved = json.loads(json.dumps(strokes))
        point = moved[-1]["points"][len(moved[-1]["points"]) // 2]
        point[1] += 0.01 * moved[-1]["radius"]
        self.assertNotEqual(self.replayed(moved), head["hash"])

    def replayed(self, strokes):
        file = studio.folder() / "strokes.json"
        file.write_text(json.dumps(strokes))
        out = studio.folder() / "replayed.relief"
        relief("sculpt", self.original, "--strokes", file, "-o", out, "--force", "--json")
        return hash_of(out)


class Symmetry(OneStudio):
    """A stroke on one side, and the same on the other."""

    def sides(self, before, after):
        """Pixels that differ left and right of the middle."""
        x, y, width, height = self.studio.middle(0.6)
        half = width // 2
        halves = ((x, y, half, height), (x + half, y, half, height))
        return [before.crop(part).differing(after.crop(part), 8) for part in halves]

    def test_symmetry_in_x(self):
        s = self.studio
        s.press("Carve")
        s.hand.at(*s.pixel(0.5, 0.5))
        mark = s.log.mark()
        s.hand.keys("1")  # from the front, so that the plane of x is the middle of the picture
        s.hands_off()
        s.settled(mark=mark)
        area = s.middle(0.6)
        clean = s.picture(area)
        one = s.stroke((0.36, 0.50), (0.39, 0.55))
        left, right = self.sides(clean, s.picture(area))
        self.assertGreater(left, 200)
        # Slabs that reach over the middle get finer grids, whose stitched borders are shaded a little differently.
        self.assertLess(right, 0.25 * left)
        mark = s.log.mark()
        s.press("Undo")
        s.log.wait("history", mark)
        s.press("Symmetry")
        two = s.stroke((0.36, 0.50), (0.39, 0.55))
        left_too, right_too = self.sides(clean, s.picture(area))
        self.assertAlmostEqual(left_too, left, delta=0.02 * left)
        self.assertGreater(right_too, 0.4 * left)
        self.assertGreater(two["samples"], 1.5 * one["samples"])
        self.assertLess(two["samples"], 2.7 * one["samples"])  # the slabs of the other side are not the mirrored ones


class Mirrored(Case):
    """Symmetry makes what a second hand makes at the mirrored place. A picture is not its own mirror image, for its light comes
    from one side: a ball, the same on both sides, is carved on both by hand and by symmetry, and the pictures are compared."""

    AROUND, ALONG = 96, 48  # corners of the ball's mesh

    def ball(self):
        """A ball around the origin, each corner with its mirror image, and the model of it."""
        mesh, made = studio.folder() / "ball.ply", studio.folder() / "ball.relief"
        rows = [(math.sin(math.pi * j / self.ALONG), math.cos(math.pi * j / self.ALONG)) for j in range(1, self.ALONG)]
        corners = [(0, 1, 0), (0, -1, 0)]
        corners += [(r * math.sin(2 * math.pi * i / self.AROUND), y, r * math.cos(2 * math.pi * i / self.AROUND))
                    for r, y in rows for i in range(self.AROUND)]
        at = lambda j, i: 2 + j * self.AROUND + i % self.AROUND
        last = self.ALONG - 2
        faces = [face for i in range(self.AROUND) for face in ((0, at(0, i), at(0, i + 1)), (1, at(last, i + 1), at(last, i)))]
        faces += [face for j in range(last) for i in range(self.AROUND)
                  for face in ((at(j, i), at(j + 1, i), at(j + 1, i + 1)), (at(j, i), at(j + 1, i + 1), at(j, i + 1)))]
        mesh.write_text("\n".join((
            "ply", "format ascii 1.0", f"element vertex {len(corners)}", "property double x", "property double y", "property double z",
            f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header",
            *(f"{50 * x:.15g} {50 * y:.15g} {50 * z:.15g}" for x, y, z in corners), *(f"3 {a} {b} {c}" for a, b, c in faces), "")))
        relief("convert", mesh, "--slabs", 100, "--samples", 15, "-o", made)
        return made

    def test_two_hands_or_one(self):
        s = Studio(self.ball())
        s.press("Carve")
        s.hand.at(*s.pixel(0.5, 0.5))
        mark = s.log.mark()
        s.hand.keys("1")
        s.hands_off()
        s.settled(mark=mark)
        camera = s.log.last("camera")
        self.assertAlmostEqual(camera["target"][0], 0, delta=0.05)  # mm: half a pixel
        x, y, width, height = s.middle(0.6)
        half = width // 2 - 4  # without the line of the plane
        sides = (x, y, half, height), (x + width - half, y, half, height)
        pictures = lambda: [s.picture(side) for side in sides]
        left, top, full, _ = s.viewport()
        places = [s.pixel(u, v) for u, v in ((0.40, 0.46), (0.42, 0.54))]
        mirrored = [(2 * left + full - px, py) for px, py in places]
        clean = pictures()
        one = self.dabs(s, places)
        only_left = pictures()
        self.dabs(s, mirrored)
        by_hands = pictures()
        for _ in range(2 * len(places)):
            mark = s.log.mark()
            s.press("Undo")
            s.log.wait("history", mark)
        s.press("Symmetry")
        both = self.dabs(s, places)
        by_symmetry = pictures()
        differing = lambda some, others, levels: [a.differing(b, levels) for a, b in zip(some, others)]
        changed = differing(clean, by_hands, 8)
        self.assertGreater(min(changed), 1000)
        self.assertGreater(both, 1.8 * one)
        beyond = differing(by_hands, by_symmetry, 2)
        measured("pixels beyond 2 levels, left and right, of those that were changed", f"{beyond} of {changed}", "none")
        self.assertEqual(beyond[0], 0)
        self.assertLess(beyond[1], 0.02 * changed[1])
        # The control: without symmetry the other side differs.
        self.assertGreater(differing(only_left, by_symmetry, 2)[1], 0.9 * changed[1])
        self.assertTrue(s.close())

    def dabs(self, s, places):
        """By key, at pixels of the screen: a hand's way has times, and is never the same twice. How many samples they changed."""
        samples = 0
        for place in places:
            mark = s.log.mark()
            s.hand.at(*place)
            s.hand.keys("Return")
            made = s.log.wait("stroke", mark)
            s.log.wait("history", mark)
            samples += made["samples"]
        s.hands_off()
        s.settled(made["revision"], mark)
        return samples


class Colour(OneStudio):
    """Swatches, paint, and the picker that reads it back."""

    def pages(self, layer):
        """What the file holds of a layer, by stroke."""
        with contextlib.closing(sqlite3.connect(f"file:{self.file}?mode=ro", uri=True)) as base:
            return base.execute("SELECT page, stroke, hash FROM pages WHERE layer = ? ORDER BY page, stroke", (layer,)).fetchall()

    def saved(self, *points, **how):
        """A stroke that is in the file."""
        mark = self.studio.log.mark()
        made = self.studio.stroke(*points, **how)
        self.studio.log.wait("saved", mark, lambda e: e["stroke"] == made["stroke"])
        return made

    def colour(self):
        """The colour in the hand, as three numbers, by its name."""
        return wait("a colour", lambda: self.studio.described("Colours"))

    def test_01_paint_with_a_swatch_and_pick_it_again(self):
        s = self.studio
        s.press("Paint")
        s.find("Strength").queryValue().currentValue = s.find("Strength").queryValue().maximumValue
        s.press("sea blue")
        wait("sea blue in the hand", lambda: self.colour() == "sea blue")
        centre = s.around((0.5, 0.45), margin=8)
        form, colours, before = self.pages("displacement"), self.pages("colour"), s.picture(centre)
        self.saved((0.48, 0.45), (0.52, 0.45), (0.48, 0.45), (0.52, 0.45), hertz=100, steps=120)
        self.assertLessEqual(set(form), set(self.pages("displacement")), "finer grids add pages; none is written over")
        self.assertNotEqual(self.pages("colour"), colours)
        after = s.picture(centre)
        self.assertGreater(before.differing(after, 40), 100)
        self.assertTrue(all(blue > red for red, _, blue in map(channels, after.words)), "the pumpkin is blue here")
        s.press("brick red")
        wait("brick red in the hand", lambda: self.colour() == "brick red")
        s.hand.at(*s.pixel(0.5, 0.45))
        s.hand.keys("Shift_L+s")
        s.hand.click(*s.pixel(0.5, 0.45))
        picked = wait("another colour in the hand", lambda: self.colour() != "brick red" and self.colour())
        if picked != "sea blue":  # painted in steps: near it, by number
            numbers = [int(picked.rpartition("#")[2][k:k + 2], 16) for k in (0, 2, 4)]
            self.assertTrue(all(abs(a - b) <= 3 for a, b in zip(numbers, (0x35, 0x62, 0x7f))), picked)
        # Every material has light, so that the screen shows no swatch as it is. But what is painted with the picked colour looks
        # as what it was picked from, and brick red does not.
        over = (0.48, 0.45), (0.52, 0.45)
        s.stroke(*over)
        wait("the same colour on the screen", lambda: s.picture(centre).differing(after, 3) == 0)
        s.press("brick red")
        wait("brick red in the hand", lambda: self.colour() == "brick red")
        s.stroke(*over)
        self.assertGreater(s.picture(centre).differing(after, 3), 0.9 * len(after.words))

    def test_02_a_cut_leaves_the_colours(self):
        colours, form = self.pages("colour"), self.pages("displacement")
        self.studio.press("Carve")
        self.saved((0.40, 0.60), (0.45, 0.60), samples=0)
        self.assertLessEqual(set(colours), set(self.pages("colour")), "finer grids add pages; none is written over")
        self.assertNotEqual(self.pages("displacement"), form)


if __name__ == "__main__":
    studio.main()
