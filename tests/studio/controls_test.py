"""Every control: its name, its one showing, and a click on it; the work without a mouse."""

import collections
import unittest

import studio
from studio import Case, OneStudio, Studio, wait

CONTRACT = ("Viewport", "Carve", "Deposit", "Paint", "Smooth", "Flatten", "Inflate", "Clay", "Layer", "Mask", "Unmask", "Touch", "Radius",
            "Strength", "Undo", "Redo", "Symmetry", "Device", "Status", "Tool panel", "Layers panel", "History panel", "Device panel")
PRESSED = ("push button", "check box", "toggle button", "radio button", "page tab")
NAMED = PRESSED + ("slider", "menu", "menu item", "check menu item", "combo box", "spin button", "text", "tool bar", "list", "canvas")
# They end the program; each has a test of its own.
ENDS = ("Quit", "Close")


class Names(OneStudio):
    def test_01_each_name_of_the_contract_shows_once(self):
        for name in CONTRACT:
            with self.subTest(name):
                self.assertEqual(len(self.studio.showing(name, "label" if name == "Status" else None)), 1)
        self.assertEqual(self.studio.find("Viewport").getRoleName(), "canvas")
        self.assertEqual(self.studio.find("Radius").getRoleName(), "slider")
        self.assertEqual(len(self.studio.showing("no such control")), 0)

    def test_02_no_control_is_without_a_name(self):
        nameless = [(o.getRoleName(), studio.rect(o)) for o in self.studio.all(
            lambda o: o.getRoleName() in NAMED and studio.shows(o) and not o.name.strip())]
        self.assertEqual(nameless, [])

    def test_03_no_two_buttons_of_one_name(self):
        names = collections.Counter(o.name for o in self.studio.all(lambda o: o.getRoleName() in PRESSED and studio.shows(o)))
        self.assertEqual([name for name, count in names.items() if count > 1], [])

    def test_04_a_click_on_every_control(self):
        s = self.studio
        clicked = 0
        for control in list(s.all(lambda o: o.getRoleName() in PRESSED and studio.shows(o) and o.name)):
            try:
                name, shown = control.name, studio.shows(control)
                x, y, width, height = studio.rect(control)
            except Exception:
                continue  # a click on another one has replaced it
            if name in ENDS or not shown:
                continue
            with self.subTest(name):
                s.hand.click(x + width // 2, y + height // 2)
                self.back_at_the_model()
                clicked += 1
        self.assertGreater(clicked, 20)

    def back_at_the_model(self):
        """Whatever the click opened is closed by Escape, and the viewport is there."""
        s = self.studio
        wait("dialogs and menus to close", s.dismissed, rest=0.1)
        s.find("Viewport")


class Keyboard(Case):
    """Open, carve, undo and export without a mouse; what has the focus is seen."""

    def focused(self, s):
        return next(s.all(lambda o: studio.shows(o) and o.getState().contains(studio.pyatspi.STATE_FOCUSED)), None)

    def test_keyboard_only(self):
        s = Studio(ready=False)
        s.find("Start page")
        s.hand.at(2, 2)
        s.to_front()

        def at_the_sample():
            o = self.focused(s)
            if o is not None and o.name == "Pumpkin":
                return o
            s.hand.keys("Tab")
            return None
        sample = wait("the focus at the sample", at_the_sample, rest=0.1)
        seen = s.picture(studio.rect(sample))
        s.hand.keys("Tab")
        wait("the focus to be seen", lambda: s.picture(seen_rect(seen)).differing(seen) > 10)
        s.hand.keys("Shift_L+Tab")
        at = s.log.mark()
        s.hand.keys("space")
        s.log.wait("opened", at, patience=4 * studio.PATIENCE)
        s.settled(mark=at, samples=1)
        s.hand.keys("c")
        wait("Carve", lambda: studio.checked(s.find("Carve")))
        before, at = s.picture(), s.log.mark()
        s.hand.keys("Right", "Right", "Down", "Return")
        made = s.log.wait("stroke", at)
        self.assertGreater(made["samples"], 0)
        wait("the dent", lambda: before.differing(s.picture(), 16) > 100)
        at = s.log.mark()
        s.hand.keys("Control_L+z")
        s.log.wait("history", at, lambda e: e["undo"] == 0)
        out = studio.folder() / "by-keyboard.ply"
        s.hand.keys("F3")
        s.find("Commands")
        s.hand.keys(*"export", "Return")
        wait("the dialog", lambda: any(True for _ in s.all(lambda o: o.getRoleName() in ("dialog", "file chooser") and studio.shows(o))))
        s.hand.keys("Control_L+a")
        s.hand.write(str(out))
        s.hand.keys("Return")
        wait("the exported file", out.exists, 3 * studio.PATIENCE)
        self.assertTrue(s.close())


def seen_rect(picture):
    return picture.x, picture.y, picture.width, picture.height


if __name__ == "__main__":
    studio.main()
