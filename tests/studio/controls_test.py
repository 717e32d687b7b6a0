"""Every control: its name, its one showing, and a click on it; the work without a mouse."""

import collections
import unittest

import studio
from studio import Case, OneStudio, Studio, model, relief, steady, wait

CONTRACT = ("Viewport", "Carve", "Deposit", "Paint", "Smooth", "Flatten", "Inflate", "Clay", "Layer", "Mask", "Unmask", "Touch", "Radius",
            "Strength", "Undo", "Redo", "Symmetry", "Device", "Status", "Tool panel", "Layers panel", "History panel", "Device panel")
PRESSED = ("push button", "check box", "toggle button", "radio button", "page tab")
NAMED = PRESSED + ("slider", "menu", "menu item", "check menu item", "combo box", "spin button", "text", "tool bar", "list", "canvas")
CLICKED = PRESSED + ("slider", "combo box", "list item")
# They end the program or close the model or a dialog; each has a test of its own.
ENDS = ("Quit", "Close")
# What the window looks like after these hides other controls: a key takes it back.
UNDONE = {"Full screen": "F11", "Hide or show all panels": "F4"}


def in_closed_choice(o):
    """The entries of a choice count as shown, though its list is closed."""
    return o.getRoleName() == "list item" and o.parent.parent.getRoleName() == "combo box"


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

    def click_each(self, root, after, *left_out, within=(0.5,)):
        """A click on each showing control below a root, in the middle or at shares of a slider's width, and after() it; their names."""
        s, clicked = self.studio, []
        for control in list(s.all(lambda o: o.getRoleName() in CLICKED and studio.shows(o) and o.name and not in_closed_choice(o), root)):
            try:
                name, role, shown, (x, y, width, height) = control.name, control.getRoleName(), studio.shows(control), studio.rect(control)
            except Exception:
                continue  # a click on another one has replaced it
            if name in ENDS + left_out or not shown:
                continue
            with self.subTest(name):
                windows = len(s.dialogs())
                for share in within if role == "slider" else (0.5,):
                    s.hand.click(x + int(share * width), y + height // 2)
                if role == "combo box" and control.getState().contains(studio.pyatspi.STATE_ENABLED):
                    wait("its list", lambda: len(s.dialogs()) > windows)  # else the next click falls into it
                    steady(s.dialogs, 0.1)
                    s.hand.keys("Escape")
                    wait("its list to close", lambda: len(s.dialogs()) <= windows)
                after()
                clicked.append(name)
        return clicked

    def test_04_a_click_on_every_control(self):
        self.assertGreater(len(self.click_each(None, self.back_at_the_model, within=(0.2, 0.7))), 20)

    def entries(self, menu):
        return [o for o in self.studio.all(lambda o: o.getRoleName() == "menu item" and o.name, menu) if o != menu]

    def menus(self):
        bar = next(self.studio.all(lambda o: o.getRoleName() == "menu bar" and studio.shows(o)))
        return [bar.getChildAtIndex(k) for k in range(bar.childCount)]

    def go(self, *way):
        """Clicks through menus, from the bar to an entry."""
        for o in way:
            wait(f"{o.name} on the screen", lambda: studio.shows(o))
            x, y, width, height = studio.rect(o)
            self.studio.hand.click(x + width // 2, y + height // 2)

    def test_05_a_click_on_every_entry_of_the_menus(self):
        s = self.studio
        ways = []  # from the bar to an entry that has none below it
        for top in self.menus():
            inner = [o for o in self.entries(top) if o.childCount]
            within = [(top, menu, o) for menu in inner for o in self.entries(menu)]
            ways += within + [(top, o) for o in self.entries(top) if o not in inner and all(o != way[-1] for way in within)]
        self.assertGreater(len(ways), 60)
        clicked = []
        for way in ways:
            name = way[-1].name
            if name.startswith(ENDS):
                continue
            with self.subTest(name):
                self.go(*way)
                if way[-1].getState().contains(studio.pyatspi.STATE_ENABLED):
                    wait("the menu to close", lambda: not studio.shows(way[-1]))
                    if name.endswith("…"):  # it asks
                        wait(f"the question of {name}", lambda: s.dialogs() or s.showing("Commands"))
                clicked.append(name)
                self.back_at_the_model(late=False)
                if name in UNDONE:
                    s.hand.keys(UNDONE[name])
        for name in ("Save a turntable …", "Stretch", "Play a recording …", "Roll left", "Make everything finer"):  # each kind of them
            self.assertIn(name, clicked)
        self.assertEqual(s.log.since(0, "failed"), [])

    def test_06_every_control_of_the_preferences(self):
        s = self.studio
        s.hands_off()
        s.hand.keys("Control_L+comma")
        dialog = s.find("Preferences", "dialog")
        pages = list(s.all(lambda o: o.getRoleName() == "list item", s.find("Pages", "list", dialog)))
        self.assertGreater(len(pages), 3)
        names = [page.name for page in pages]

        def close_what_came():
            """A list, or a question; the preferences themselves stay."""
            while len(steady(s.dialogs, 0.2)) > 1:
                s.hand.keys("Escape")
        clicked = set()
        for page in pages:
            x, y, width, height = studio.rect(page)
            s.hand.click(x + width // 2, y + height // 2)
            clicked.update(self.click_each(dialog, close_what_came, *names, within=(0.3,)))
        self.assertGreater(len(clicked), 15)
        self.back_at_the_model()

    def test_07_every_control_of_a_device(self):
        s = self.studio
        menu = next(menu for menu in self.menus() if menu.name == "Devices")
        device = lambda name: self.go(menu, next(o for o in self.entries(menu) if o.name == name))
        mark = s.log.mark()
        device("Simulated hand")
        s.log.wait("hand", mark)
        self.assertGreater(len(self.click_each(s.find("Device panel"), self.back_at_the_model, within=(0.2, 0.7))), 5)
        mark = s.log.mark()
        device("No device")
        s.log.wait("device-end", mark)

    def back_at_the_model(self, late=True):
        """Whatever the click opened is closed by Escape, and the viewport is there. It may come late, where nobody has waited for it."""
        s = self.studio
        if late:
            steady(s.dialogs, 0.2)
        wait("dialogs and menus to close", s.dismissed, rest=0.1)
        s.find("Viewport")


class Keyboard(Case):
    """Open, carve, undo and export without a mouse; what has the focus is seen."""

    def focused(self, s):
        return next(s.all(lambda o: studio.shows(o) and o.getState().contains(studio.pyatspi.STATE_FOCUSED)), None)

    ACCENT = 0xe3, 0x9a, 0x5c  # of the dark theme; nothing else has a border of it

    def ringed(self, s, name, role=None, root=None):
        """Whether the border of a control, three pixels wide, is lit: at least a line of a pixel and a half around all of it."""
        try:
            x, y, width, height = studio.rect(s.find(name, role, root))
        except Exception:
            return False  # another one has taken its place
        picture = s.picture((x, y, width, height))
        border = (picture.at(x + i, y + j) for j in range(height) for i in
                  (range(width) if min(j, height - 1 - j) < 3 else (0, 1, 2, width - 3, width - 2, width - 1)))
        lit = sum(max(abs(a - b) for a, b in zip(pixel, self.ACCENT)) < 40 for pixel in border)
        return lit > 1.2 * (width + height)

    def focus_seen(self, s, name, role, *others):
        """In this step the control is ringed, and the others, which are on the screen too, are not."""
        wait(f"the focus to be seen at {name!r}", lambda: self.ringed(s, name, role))
        for other in others:
            self.assertFalse(self.ringed(s, *other), other)

    def test_keyboard_only(self):
        studio.settings("[look]", "theme=dark")
        self.addCleanup(studio.settings)
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
        s.hand.keys("Right", "Right", "Down")
        self.focus_seen(s, "Viewport", None, ("Radius", "slider"))
        s.hand.keys("Return")
        made = s.log.wait("stroke", at)
        self.assertGreater(made["samples"], 0)
        wait("the dent", lambda: before.differing(s.picture(), 16) > 100)
        at = s.log.mark()
        s.hand.keys("Control_L+z")
        s.log.wait("history", at, lambda e: e["undo"] == 0)
        self.focus_seen(s, "Viewport", None, ("Paint",))
        out = studio.folder() / "by-keyboard.ply"
        s.hand.keys("F3")
        field = next(s.all(lambda o: o.getRoleName() == "text" and studio.shows(o), s.find("Commands"))).name
        self.focus_seen(s, field, "text", ("Viewport",))
        s.hand.keys(*"export", "Return")
        self.focus_seen(s, "File name:", "text", ("Cancel", "push button"))
        s.type_into("File name:", str(out))
        s.hand.keys("Return")
        s.find("Export", "push button")
        level = next(s.all(lambda o: o.getRoleName() == "combo box" and studio.shows(o) and label_of(o) == "Level of detail")).name
        self.focus_seen(s, level, "combo box", ("As the model lies", "combo box"), ("Cancel", "push button"))
        s.hand.keys("Return")
        wait("the exported file", out.exists, 3 * studio.PATIENCE)
        self.assertTrue(s.close())


def label_of(o):
    """What a choice is called: its own name is what is chosen."""
    return next((r.getTarget(0).name for r in o.getRelationSet() if r.getRelationType() == studio.pyatspi.RELATION_LABELLED_BY), "")


class Export(OneStudio):
    """What the window exports is what the command line exports, to the byte."""

    @classmethod
    def setUpClass(cls):
        cls.file = model(intervals=16)
        cls.studio = Studio(cls.file)

    def named(self, name):
        """Ctrl+E, and a name in the file dialog."""
        s = self.studio
        out = studio.folder() / name
        s.hands_off()
        s.to_front()
        s.hand.keys("Control_L+e")
        s.type_into("File name:", str(out))
        s.hand.keys("Return")
        return out

    def asked(self):
        """The dialog of the export."""
        self.studio.find("Export", "push button")
        return next(self.studio.all(lambda o: o.name.startswith("Export ") and o.getRoleName() == "dialog" and studio.shows(o)))

    def choices(self):
        """Its choices, by the label of each."""
        return {label_of(o): o for o in self.studio.all(lambda o: o.getRoleName() == "combo box" and studio.shows(o), self.asked())}

    def take_next(self, choice):
        """The next one of a choice: a click, and a key in its list."""
        s, was, dialogs = self.studio, choice.name, len(self.studio.dialogs())
        x, y, width, height = studio.rect(choice)
        s.hand.click(x + width // 2, y + height // 2)
        wait("its list", lambda: len(s.dialogs()) > dialogs)
        s.hand.keys("Down", "Return")
        wait("the next one", lambda: choice.name != was and len(s.dialogs()) == dialogs)

    def exported(self, out, mark):
        self.assertEqual(self.studio.log.wait("exported", mark, patience=3 * studio.PATIENCE)["file"], str(out))
        wait("the dialogs to close", lambda: not self.studio.dialogs())
        return out.read_bytes()

    def by_command(self, extension, *options):
        out = studio.folder() / f"by-command{extension}"
        relief("export", self.file, out, *options)
        return out.read_bytes()

    def test_01_every_sample_as_it_lies_unless_somebody_asks(self):
        mark, out = self.studio.log.mark(), self.named("plain.ply")
        self.assertEqual(self.asked().name, "Export plain.ply")
        choices = self.choices()
        self.assertEqual(sorted(choices), ["Level of detail", "Up axis"])
        self.assertEqual(choices["Up axis"].name, "As the model lies")
        self.assertRegex(choices["Level of detail"].name, "^Every sample: about [0-9,.]+ triangles$")
        self.assertFalse(out.exists())
        self.studio.hand.keys("Return")
        self.assertEqual(self.exported(out, mark), self.by_command(".ply"))

    def test_02_with_a_level_and_an_up_axis(self):
        for extension in (".obj", ".glb"):
            with self.subTest(extension):
                mark, out = self.studio.log.mark(), self.named(f"turned{extension}")
                choices = self.choices()
                level, up = choices["Level of detail"], choices["Up axis"]
                self.take_next(level)
                self.assertRegex(level.name, "^One sample in 2: about [0-9,.]+ triangles$")
                if extension == ".obj":  # the axis is remembered, the level is not
                    self.take_next(up)
                self.assertRegex(up.name, "^z: ")
                self.studio.press("Export", "push button")
                made = self.exported(out, mark)
                self.assertEqual(made, self.by_command(extension, "--level", 1, "--up", "z"))
                self.assertNotEqual(made, self.by_command(extension, "--level", 1))
                self.assertNotEqual(made, self.by_command(extension, "--up", "z"))

    def test_03_slabs_have_neither_and_nobody_is_asked(self):
        mark, out = self.studio.log.mark(), self.named("cage.slabs")
        self.assertEqual(self.exported(out, mark), self.by_command(".slabs"))

    def test_04_cancel_writes_nothing(self):
        s = self.studio
        mark = s.log.mark()
        self.named("never.stl")
        self.asked()
        s.press("Cancel", "push button")
        wait("the dialog to close", lambda: not s.dialogs())
        self.assertEqual(s.log.since(mark, "exported"), [])
        self.assertEqual([file.name for file in studio.folder().iterdir() if "never" in file.name], [])

    def test_05_a_name_without_an_extension_gets_that_of_the_kind(self):
        s = self.studio
        s.hands_off()
        s.hand.keys("Control_L+e")
        s.type_into("File name:", str(studio.folder() / "kind"))
        self.take_next(s.find("PLY (*.ply)", "combo box"))
        s.hand.keys("Return")
        self.assertEqual(self.asked().name, "Export kind.stl")
        s.press("Cancel", "push button")
        wait("the dialog to close", lambda: not s.dialogs())


class ExportOfOneLevel(Case):
    """A grid of 15 intervals has every sample or none: nothing is to be chosen there."""

    def test_the_level_is_not_shown(self):
        s = Studio(model(intervals=15))
        s.hands_off()
        s.hand.keys("Control_L+e")
        wait("the file dialog", s.dialogs)
        s.hand.keys("Return")
        s.find("Export", "push button")
        dialog = next(s.all(lambda o: o.name.startswith("Export ") and o.getRoleName() == "dialog" and studio.shows(o)))
        self.assertEqual([label_of(o) for o in s.all(lambda o: o.getRoleName() == "combo box" and studio.shows(o), dialog)], ["Up axis"])
        s.press("Cancel", "push button")
        self.assertTrue(s.close())


def seen_rect(picture):
    return picture.x, picture.y, picture.width, picture.height


if __name__ == "__main__":
    studio.main()
