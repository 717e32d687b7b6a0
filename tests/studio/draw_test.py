"""What is on the screen is what the model is: the changed rectangle against a full redraw, the window against relief render."""

import pathlib
import random
import subprocess
import unittest

import studio
from studio import Case, Studio, measured, model, relief, wait


studio.settings(samples=16)  # what people see


class Rectangles(Case):
    """Fifty strokes, each drawn by its rectangle alone. That bounds which are 8 pixels too small would be found out is the control
    of DirtyRectangle.GivesTheBitsOfAFullRedraw (tests/unit/render/frame_test.cpp): no studio can be told to draw such ones."""

    STROKES = 50

    def test_rectangles_add_up_to_the_whole(self):
        chance = random.Random(36)
        s = Studio(model())
        keys = {"c": "carve", "d": "deposit", "b": "paint", "s": "smooth"}  # at once: while a hand rests, the whole picture is refined
        s.hands_off()
        s.settled()
        mark = s.log.mark()
        for k in range(self.STROKES):
            key, tool = list(keys.items())[k // 10 % len(keys)]
            if k % 10 == 0:
                s.hand.at(*s.pixel(0.5, 0.5))
                s.hand.keys(key)
            u, v = chance.uniform(0.38, 0.6), chance.uniform(0.35, 0.62)
            made = s.stroke((u, v), (u + chance.uniform(-0.05, 0.05), v + chance.uniform(-0.05, 0.05)), steps=12, samples=0)
            self.assertEqual(made["tool"], tool)
        s.hands_off()
        s.settled(made["revision"], mark)
        moving = [f for f in s.log.since(mark, "frame") if f["samples"] == 1 and f["rect"][2] > 0]
        # The first frame after room draws most of so small a model anew: its fibres are others.
        same = [f for before, f in zip(moving, moving[1:]) if f["cage"] == before["cage"]]
        full = [f for f in same if f["full"]]
        self.assertGreater(len(same), self.STROKES)
        measured("frames drawn whole during the strokes", f"{len(full)} of {len(same)}; {len(moving) - 1 - len(same)} with other fibres", "10 % at most")
        self.assertLess(len(full), 0.1 * len(same), "a studio that always draws all has nothing but those")
        by_rectangles = s.picture()
        mark = s.log.mark()
        s.hand.keys("Alt_L+w")  # wires and none again: the same picture, drawn whole
        s.settled(mark=mark)
        self.assertNotEqual(s.picture(), by_rectangles)
        mark = s.log.mark()
        s.hand.keys("Alt_L+w")
        frame = s.settled(mark=mark)
        self.assertTrue(frame["full"])
        wait("the same picture, drawn whole", lambda: s.picture() == by_rectangles)
        self.assertTrue(s.close())


def pixels(png):
    """Size and RGB bytes of a PNG file."""
    size = subprocess.run(["identify", "-format", "%w %h", png], capture_output=True, text=True, check=True).stdout
    return size, subprocess.run(["convert", png, "-depth", "8", "rgb:-"], capture_output=True, check=True).stdout


class Picture(Case):
    """F12 and relief render."""

    def test_f12_is_what_relief_render_draws(self):
        file = model()
        s = Studio(file)
        s.press("Carve")
        s.stroke((0.42, 0.45), (0.58, 0.5))
        s.hand.at(*s.pixel(0.5, 0.5))
        mark = s.log.mark()
        s.hand.keys("F12")
        picture = pathlib.Path(s.log.wait("picture", mark)["file"])
        wait("the picture's file", picture.exists)
        camera = s.log.last("camera")
        size, mine = pixels(picture)
        s.close()
        theirs = studio.folder() / "render.png"
        words = ["render", file, "-o", theirs, "--size", size.replace(" ", "x"), "--camera",
                 ",".join("%.17g" % n for n in [*camera["eye"], *camera["target"], *camera["up"], camera["fov"]])]
        relief(*words, "--look", "matcap")
        self.assertEqual(pixels(theirs)[1], mine)
        relief(*words, "--look", "studio")  # the control: another light
        self.assertNotEqual(pixels(theirs)[1], mine)


if __name__ == "__main__":
    studio.main()
