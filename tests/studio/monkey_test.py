"""Random hands: nothing that they do may end the studio, leave a dialog behind, or lose the way back to the first hash.

A minute with one seed; ten with another each time in the long form. RELIEF_MONKEY_SEED=N plays one again, RELIEF_MONKEY_SECONDS=N sets how long.
"""

import os
import random
import time
import unittest

import studio
from studio import Case, SOAK, Studio, measured, model, wait

ROLES = ("push button", "check box", "toggle button", "radio button", "menu item", "check menu item", "slider", "page tab", "list item",
         "combo box", "spin button")
# What ends the program or asks the person's files; and what would leave a desktop without a window to look at.
NEVER = ("quit", "close", "exit", "file", "open", "save", "export", "recent", "minimi", "kiosk", "import", "picture", "folder", "load")
KEYS = ("c", "d", "b", "s", "i", "m", "t", "1", "3", "7", "5", "Home", "bracketleft", "bracketright", "x", "Alt_L+w", "Alt_L+h",
        "F4", "F4", "Tab", "Control_L+z", "Control_L+Shift_L+z", "F3", "Escape", "Escape", "Return", "Up", "Left", "F6", "f", "Pause")


class Monkey(Case):
    def test_random_hands(self):
        seed = int(os.environ.get("RELIEF_MONKEY_SEED", time.time_ns() % 1_000_000 if SOAK else 7))
        seconds = float(os.environ.get("RELIEF_MONKEY_SECONDS", 600 if SOAK else 60))
        print(f"\n  seed {seed}", flush=True)
        self.chance = random.Random(seed)
        self.s = s = Studio(model(), "--device", "simulated")
        # What opens a dialog answers once that is closed, as far as the bus is concerned. No hand waits for it.
        studio.Atspi.set_timeout(3000 * studio.SLOW, 3000 * studio.SLOW)
        first = s.log.last("opened")["hash"]
        self.done = []
        self.check()
        self.other_theme = next(s.all(lambda o: o.name == "Light or dark" and o.getRoleName() == "menu item"))
        end, checked = time.monotonic() + seconds, time.monotonic()
        middle = end - seconds / 2
        acts = 2 * (self.carve, self.carve, self.carve, self.turn, self.wheel, self.key, self.key, self.widget, self.widget, self.undo,
                    self.resize) + (self.theme,)
        while time.monotonic() < end:
            if time.monotonic() > middle:
                self.check()
                s.hand.at(*s.pixel(0.5, 0.5))
                self.back_to(first)
                middle = end
            act = self.chance.choice(acts)
            try:
                act()
            except AssertionError as e:
                if s.process.poll() is not None:
                    self.fail(self.told(f"ended with {s.process.returncode}: {s.said()[-1500:]}"))
                self.done.append(f"({e})")
            self.assertIsNone(s.process.poll(), self.told(s.said()[-1500:]))
            if time.monotonic() - checked > 5:
                self.check()
                checked = time.monotonic()
        self.check()
        strokes = len(s.log.since(0, "stroke"))
        themes = self.done.count("theme")
        measured("random acts; strokes and changes of the theme among them", f"{len(self.done)}; {strokes} and {themes}", "no crash")
        self.assertGreater(strokes, 0, "how many there are depends on the machine; without any it was no test")
        s.hand.at(*s.pixel(0.5, 0.5))
        self.back_to(first)
        self.assertTrue(s.close(), self.told(s.said()[-1500:]))
        self.assertNotIn("ERROR: AddressSanitizer", s.said())

    def told(self, what):
        return f"{what}; the last acts: {self.done[-12:]}"

    def back_to(self, first):
        """Undo to the bottom, once all is done that the hand has asked for: an event says the hash of the moment in which it is
        written, and a stroke may have begun by then."""
        s = self.s
        studio.steady(lambda: [e for e in s.log.update() if e["event"] in ("stroke", "history", "saved")][-1:], rest=3)
        if s.log.last("history") is None:
            return  # nothing has been done

        def at_the_bottom():
            left = s.log.last("history")["undo"]
            undo = s.find("Undo").queryAction()  # with the last act's theme or language come other buttons
            for _ in range(left):
                undo.doAction(0)
            return left == 0
        wait("the bottom of the history", at_the_bottom, rest=0.5)  # the first press may end a stroke, which is one more
        self.assertEqual(s.log.last("history")["hash"], first, self.told("undo to the bottom"))

    def check(self):
        """No dialog stays; the window answers."""
        s = self.s
        s.hand.let_go()
        try:
            wait("every dialog to close by Escape", s.dismissed, rest=0.2)
        except AssertionError as e:
            self.fail(self.told(e))
        s.to_front()
        s.hand.keys("Escape")
        s.find("Viewport")
        self.widgets = [o for o in s.all(lambda o: o.getRoleName() in ROLES and studio.shows(o) and o.name and
                                         not any(word in o.name.lower() for word in NEVER))]

    def place(self):
        return self.s.pixel(self.chance.uniform(0.2, 0.8), self.chance.uniform(0.2, 0.8))

    def drag(self, button, keys=()):
        s = self.s
        corners = [self.place() for _ in range(self.chance.randint(2, 4))]
        s.hand.at(*corners[0])
        for key in keys:
            s.hand.hold_key(key)
        s.hand.down(button)
        s.hand.path(studio.along(corners, 80), self.chance.choice((125, 500, 1000)))
        s.hand.up(button)
        s.hand.let_go()

    def carve(self):
        self.done.append("stroke")
        self.drag(1, self.chance.choice(((), (), (), ("Shift_L",), ("Control_L",))))

    def turn(self):
        self.done.append("turn")
        self.drag(2, self.chance.choice(((), ("Shift_L",), ("Control_L",))))

    def wheel(self):
        self.done.append("wheel")
        self.s.hand.at(*self.place())
        for _ in range(self.chance.randint(1, 4)):
            button = self.chance.choice((4, 5))
            self.s.hand.down(button)
            self.s.hand.up(button)

    def key(self):
        key = self.chance.choice(KEYS)
        self.done.append(key)
        self.s.hand.at(*self.place())
        self.s.hand.keys(key)

    def undo(self):
        for _ in range(self.chance.randint(1, 5)):
            self.s.hand.keys(self.chance.choice(("Control_L+z", "Control_L+Shift_L+z")))
        self.done.append("undo")

    def widget(self):
        o, s = self.chance.choice(self.widgets), self.s
        try:
            self.done.append(f"{o.getRoleName()} {o.name}")
            if o.getRoleName() in ("slider", "spin button"):
                value = o.queryValue()
                value.currentValue = self.chance.uniform(value.minimumValue, value.maximumValue)
            elif self.chance.random() < 0.5 and o.queryAction().nActions:
                o.queryAction().doAction(0)
            else:
                x, y, width, height = studio.rect(o)
                s.hand.click(x + width // 2, y + height // 2)
        except Exception as e:  # it went while we reached for it
            self.done.append(f"(gone: {type(e).__name__})")

    def theme(self):
        self.done.append("theme")
        self.other_theme.queryAction().doAction(0)

    def resize(self):
        width, height = self.chance.randint(900, 1590), self.chance.randint(600, 960)
        self.done.append(f"{width}x{height}")
        self.s.window("windowsize", width, height)


if __name__ == "__main__":
    studio.main()
