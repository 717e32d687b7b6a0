"""The kiosk: captions, a way back to the first model, and no way out."""

import json
import unittest

import studio
from studio import Case, Studio, model, relief, wait


class Kiosk(Case):
    """A visitor comes, carves, tries to get out, and goes."""

    TIMEOUT = 3  # s; the countdown adds ten

    @classmethod
    def setUpClass(cls):
        folder = studio.folder() / "exhibits"
        folder.mkdir()
        cls.shown = folder / "pumpkin.relief"
        model().rename(cls.shown)
        cls.bytes = cls.shown.read_bytes()
        cls.first = relief("info", cls.shown, "--json")["content_hash"]
        (folder / "pumpkin.json").write_text(json.dumps({
            "title": "A pumpkin", "sentences": ["It was carved last autumn.", "It is hollow.", "Touch it."],
            "tools": ["touch", "carve", "paint"], "force_cap": 0.4, "timeout_s": cls.TIMEOUT}))
        cls.studio = Studio("--kiosk", folder, ready=False)

    @classmethod
    def tearDownClass(cls):
        cls.studio.kill()

    def chosen(self):
        """The visitor has touched the pumpkin's picture, and the model stands."""
        s = self.studio
        mark = s.log.mark()
        s.click("A pumpkin")
        opened = s.log.wait("opened", mark)
        s.settled(mark=mark, samples=1)
        return opened

    def test_01_choose_carve(self):
        s = self.studio
        wait("the whole screen", lambda: studio.rect(s.app.getChildAtIndex(0)) == (0, 0, 1600, 1000))
        self.assertEqual(self.chosen()["hash"], self.first)
        self.assertTrue(any("carved last autumn" in o.name + o.description for o in s.all(studio.shows)), "the caption")
        self.assertEqual([o.name for o in s.all(lambda o: o.getRoleName() in ("menu bar", "menu", "menu item") and studio.shows(o))], [])
        self.assertTrue(s.find("Carve"))
        self.assertEqual(s.showing("Smooth"), [], "the curator's tools alone")
        s.press("Carve")
        before = s.picture()
        made = s.stroke((0.45, 0.5), (0.55, 0.5), samples=1)
        self.assertNotEqual(made["hash"], self.first)
        self.assertGreater(before.differing(s.picture(), 12), 100)
        self.assertEqual(self.shown.read_bytes(), self.bytes)

    def test_02_no_way_out(self):
        s = self.studio
        if not s.showing("Viewport"):
            self.chosen()
        mark = s.log.mark()
        for chord in ("Alt_L+F4", "Control_L+o", "Control_L+q", "Control_L+w", "Control_L+s", "F3", "Control_L+k", "F11", "F12", "Escape"):
            s.hand.keys(chord)
        x, y = s.pixel(0.5, 0.5)
        s.hand.drop(studio.scan(), x, y)
        s.hand.click(x, y, 3)
        s.hand.keys("Control_L+Alt_L+Shift_L+l")
        s.find("Code to leave")
        s.hand.write("a guess")
        s.hand.keys("Return")
        wait("the field to go", lambda: not s.showing("Code to leave"))
        s.alive()
        self.assertEqual([e["event"] for e in s.log.since(mark) if e["event"] in ("failed", "opened", "exit", "convert", "exported", "picture")], [])
        self.assertEqual(len(s.windows()), 1)

    def test_03_nobody_is_there(self):
        s = self.studio
        if not s.showing("Viewport"):
            self.chosen()
        mark = s.log.mark()
        s.log.wait("kiosk", mark, lambda e: e["page"] == "countdown")
        self.assertTrue(any("Start again" in o.name + o.description for o in s.all(studio.shows)))
        s.hand.at(*s.pixel(0.4, 0.4))
        s.hand.at(*s.pixel(0.41, 0.4))
        wait("the countdown to stop", lambda: not any("touch to go on" in o.name + o.description for o in s.all(studio.shows)))
        self.assertEqual([e for e in s.log.since(mark, "kiosk") if e["page"] == "reset"], [])
        s.log.wait("kiosk", mark, lambda e: e["page"] == "reset", patience=30 + studio.PATIENCE)
        self.assertEqual(self.shown.read_bytes(), self.bytes)
        x, y, width, height = 0, 0, 1600, 1000  # what turns is the screen; a touch brings the pictures back
        s.hand.click(x + width // 2, y + height // 2)
        self.assertEqual(self.chosen()["hash"], self.first)

    def test_04_the_code_leads_out(self):
        s = self.studio
        s.hand.keys("Control_L+Alt_L+Shift_L+l")
        s.find("Code to leave")
        s.hand.write("relief")
        s.hand.keys("Return")
        self.assertEqual(s.process.wait(studio.PATIENCE), 0)


if __name__ == "__main__":
    studio.main()
