"""The kiosk: captions, a way back to the first model, and no way out."""

import json
import unittest

import studio
from studio import Case, Studio, model, wait


class Kiosk(Case):
    def test_visitor(self):
        folder = studio.folder() / "exhibits"
        folder.mkdir()
        shown = folder / "pumpkin.relief"
        model().rename(shown)
        (folder / "pumpkin.json").write_text(json.dumps({"title": "A pumpkin", "sentences": ["It was carved last autumn.", "It is hollow.", "Touch it."], "timeout_s": 4}))
        first = studio.relief("info", shown, "--json")["content_hash"]
        s = Studio("--kiosk", folder, ready=False)
        card = s.find("A pumpkin")
        mark = s.log.mark()
        x, y, width, height = studio.rect(card)
        s.hand.click(x + width // 2, y + height // 2)
        s.log.wait("opened", mark)
        s.settled(mark=mark)
        self.assertTrue(next(s.all(lambda o: "carved last autumn" in o.name + o.description and studio.shows(o)), None))
        self.assertFalse(list(s.all(lambda o: o.getRoleName() in ("menu bar", "menu item") and studio.shows(o))))
        before = s.picture()
        s.press("Carve")
        made = s.stroke((0.45, 0.5), (0.55, 0.5))
        self.assertNotEqual(made["hash"], first)
        self.assertGreater(before.differing(s.picture(), 8), 100)
        # No way out.
        mark = s.log.mark()
        for chord in ("Alt_L+F4", "Control_L+o", "Control_L+q", "Control_L+s", "F3", "Control_L+k", "Escape", "F11"):
            s.hand.keys(chord)
        s.hand.drop(studio.scan(), *s.pixel(0.5, 0.5))
        self.assertIsNone(s.process.poll())
        self.assertEqual([e["event"] for e in s.log.since(mark) if e["event"] in ("dialog", "opened", "exit", "convert")], [])
        self.assertFalse(list(s.all(lambda o: o.getRoleName() in ("dialog", "file chooser") and studio.shows(o))))
        # Nobody touches it: a countdown, then the model as it was.
        s.log.wait("kiosk", mark, lambda e: e["page"] == "countdown")
        s.hand.at(*s.pixel(0.4, 0.4))
        s.log.wait("kiosk", mark, lambda e: e["page"] != "countdown")
        mark = s.log.mark()
        s.log.wait("kiosk", mark, lambda e: e["page"] == "reset", patience=40)
        self.assertEqual(studio.relief("info", shown, "--json")["content_hash"], first)
        s.kill()


if __name__ == "__main__":
    studio.main()
