"""Drives the real studio from outside: widgets by their accessible names, the viewport by X events.

A step is followed by a wait for a *state* (a line of the event log, a description, a name on the screen), never by a blind
sleep. Three witnesses can be asked: the screen (Picture), the accessibility tree, and the event log.
"""

import contextlib
import json
import math
import os
import pathlib
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import unittest

import desktop

_desktop = desktop.start()
# What is preloaded comes before the sanitizer.
os.environ["ASAN_OPTIONS"] = "verify_asan_link_order=0"
os.environ["UBSAN_OPTIONS"] = "print_stacktrace=1"
import pyatspi  # noqa: E402  it connects to the bus that desktop.start() made
from gi.repository import Atspi  # noqa: E402

from picture import Picture  # noqa: E402

BIN = pathlib.Path(os.environ["RELIEF_BIN"])          # relief, relief-studio and studio_hand stand in it
KEPT = pathlib.Path(os.environ["RELIEF_STUDIO_KEPT"])  # what failing tests leave for people
DATA = pathlib.Path(os.environ.get("RELIEF_TEST_DATA", "/none"))
SOAK = bool(os.environ.get("RELIEF_SOAK"))
SANITIZED = os.environ.get("RELIEF_SANITIZED") == "1"
SLOW = 4 if SANITIZED else 1  # how much more patience a sanitised studio gets
PATIENCE = 60 * SLOW  # seconds, for a state that must come; only a broken studio takes it all
# A window that draws on a busy machine may answer late. By default 0.8 s are an error, and look as if the control had gone.
Atspi.set_timeout(1000 * PATIENCE, 1000 * PATIENCE)


def folder():
    return _desktop.folder


def manager(signal_number):
    """To the window manager."""
    os.kill(_desktop.manager.pid, signal_number)


def forget_tools():
    """The next studio has the tools of a fresh installation; all else that is chosen stays."""
    file = folder() / "config" / "relief" / "studio.conf"
    kept, inside = [], False
    for line in file.read_text().splitlines() if file.exists() else ():
        inside = line == "[tools]" if line.startswith("[") else inside
        if not inside:
            kept.append(line)
    if kept:
        file.write_text("\n".join((*kept, "")))


_final = 4  # samples of a pixel when the picture rests


def settings(*lines, samples=4):
    """What the next studios find chosen: a window that leaves no picture larger than a test needs, a final picture that takes a
    quarter of the time that people give it, and the lines."""
    global _final
    _final = samples
    file = folder() / "config" / "relief" / "studio.conf"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("\n".join(("[window]", "size=@Size(1280 820)", "[drawing]", f"samples={samples}", *lines, "")))


def wait(what, ask, patience=PATIENCE, rest=0.01):
    """The first true answer of ask(); asked again and again."""
    end = time.monotonic() + patience
    while True:
        answer = ask()
        if answer:
            return answer
        if time.monotonic() > end:
            raise AssertionError(f"waited {patience} s in vain for {what}")
        time.sleep(rest)


def steady(ask, rest=0.25):
    """What ask() says once it has said the same for `rest` seconds: for figures that follow the hand."""
    last, since = ask(), time.monotonic()

    def stands():
        nonlocal last, since
        now = ask()
        if now != last:
            last, since = now, time.monotonic()
        return time.monotonic() - since > rest
    wait("a figure that stands", stands)
    return last


def relief(*words):
    """What the command line says; with --json, the object."""
    done = subprocess.run([BIN / "relief", *map(str, words)], capture_output=True, text=True, timeout=60 * SLOW)
    assert done.returncode == 0, f"relief {words}: {done.stderr}"
    return json.loads(done.stdout) if "--json" in words else done.stdout


def model(slabs=200, intervals=15, sample="pumpkin"):
    """A copy of a converted sample for one test to spoil; the conversion is made once a program. The presets are the paper's
    45 000 triangles."""
    made = folder() / f"{sample}-{slabs}-{intervals}.relief"
    if not made.exists():
        relief("convert", scan(sample), "--slabs", slabs, "--samples", intervals, "-o", made)
    copy = folder() / f"model-{time.monotonic_ns()}.relief"
    shutil.copyfile(made, copy)
    return copy


def journal(file):
    """The strokes that a model file holds, as a strokes file has them."""
    with contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as base:
        return [json.loads(row[0]) for row in base.execute("SELECT details FROM strokes WHERE number > 0 ORDER BY number")]


def scan(sample="pumpkin", triangles=20000):
    mesh = folder() / f"{sample}-{triangles}.ply"
    if not mesh.exists():
        relief("sample", sample, "-o", mesh, "--triangles", triangles)
    return mesh


settings()


class Hand:
    """The pointer and keys: studio_hand, kept running."""

    def __init__(self):
        self.process = subprocess.Popen([BIN / "studio_hand"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.held = []

    def say(self, *words):
        """The time of the answer in ms, and its first word."""
        self.process.stdin.write(" ".join(str(word) for word in words) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().split()
        assert answer, f"studio_hand ended at {words[:6]}"
        self.last = answer
        return float(answer[1]), answer[0]

    def at(self, x, y):
        return self.say("at", round(x), round(y))[0]

    def path(self, points, hertz=250):
        """One motion per point, paced; the longest wait between two in ms."""
        self.say("path", hertz, *(round(number) for point in points for number in point))
        return float(self.last[2])

    def down(self, button=1):
        return self.say("down", button)[0]

    def up(self, button=1):
        return self.say("up", button)[0]

    def click(self, x, y, button=1):
        self.at(x, y)
        self.down(button)
        self.up(button)

    def keys(self, *chords):
        """Key chords, at once: "c", "Control_L+z", "F12"."""
        words = []
        for chord in chords:
            names = chord.split("+")
            words += [name + "+" for name in names] + [name + "-" for name in reversed(names)]
        self.say("keys", *words)

    def write(self, text):
        """Types a text, as xdotool does, with the keys that the letters need."""
        subprocess.run(["xdotool", "type", "--delay", "2", text], check=True, timeout=60)

    def hold_key(self, name):
        self.held.append(name)
        self.say("keys", name + "+")

    def release_key(self, name):
        self.held.remove(name)
        self.say("keys", name + "-")

    def let_go(self):
        """Of all keys and buttons: the next test begins with free hands."""
        for name in list(self.held):
            self.release_key(name)
        for button in (1, 2, 3):
            self.up(button)

    def drop(self, file, x, y):
        """A file manager lets a file fall there; False where nobody takes it."""
        return self.say("drop", round(x), round(y), file)[1] == "ok"

    def grab(self, rect=None):
        """A Picture of a rectangle of the screen, or of all of it."""
        x, y, width, height = rect or (0, 0, _desktop.width, _desktop.height)
        file = folder() / "grabbed"
        self.say("grab", x, y, width, height, file)
        return Picture.read(file, width, height, x, y)

    def changes(self, rect, act, patience=5000):
        """The time in ms from what act() did to the first change of a rectangle; None where none came."""
        self.say("hold", *rect)
        begun = act()
        seen, word = self.say("until", patience)
        return seen - begun if word == "ok" else None


class Log:
    """The events that a studio writes, as they come."""

    def __init__(self, file, alive=lambda: None):
        self.file, self.alive, self.events, self._rest, self._read = file, alive, [], b"", 0

    def update(self):
        if self.file.exists():
            with open(self.file, "rb") as log:
                log.seek(self._read)
                fresh = log.read()
            self._read += len(fresh)
            *lines, self._rest = (self._rest + fresh).split(b"\n")
            self.events += [json.loads(line) for line in lines if line.strip()]
        return self.events

    def mark(self):
        """The place after all that has been written so far; for since()."""
        return len(self.update())

    def since(self, mark, kind=None):
        return [e for e in self.update()[mark:] if kind is None or e["event"] == kind]

    def last(self, kind):
        return next((e for e in reversed(self.update()) if e["event"] == kind), None)

    def wait(self, kind, mark=0, ok=lambda event: True, patience=PATIENCE):
        """The first event of a kind since the mark that is as wanted."""
        def found():
            event = next((e for e in self.since(mark, kind) if ok(e)), None)
            if event is None:
                self.alive()
            return event
        try:
            return wait(f"the event {kind}", found, patience, 0.005)
        except AssertionError as e:
            raise AssertionError(f"{e}; since the mark came {[dict(list(x.items())[:4]) for x in self.since(mark)][-12:]}") from None


def _registry_answers():
    try:
        return pyatspi.Registry.getDesktop(0).childCount >= 0
    except Exception:
        return False  # it has just been started


class Studio:
    """A running studio."""

    def __init__(self, *words, name="studio", environment=None, ready=True, wrapper=(), same_tools=False):
        if not same_tools:
            forget_tools()
        stamp = f"{name}-{time.monotonic_ns()}"
        self.log = Log(folder() / f"{stamp}.jsonl", self.alive)
        self.errors = folder() / f"{stamp}.txt"
        self.hand = hand()
        self._known = {}  # objects by (name, role)
        # A program names itself to the registry once, when it starts: it must be there by then.
        wait("the registry of accessible programs", _registry_answers)
        began = time.monotonic()
        with open(self.errors, "wb") as errors:
            self.process = subprocess.Popen([*wrapper, BIN / "relief-studio", *map(str, words), "--log-events", self.log.file],
                                            stdin=subprocess.DEVNULL, stdout=errors, stderr=errors, env={**os.environ, **(environment or {})})
        self.app = self.main = None
        _running.append(self)
        start = self.log.wait("start")
        self.pid, self.before_log = start["pid"], 1000 * (time.monotonic() - began) - start["ms"]  # ms of the process before its log
        self.app = wait("the studio in the accessibility tree", self._find_app)
        self.main = wait("a window", self.windows)[0]
        if ready:
            self.log.wait("opened")
            self.settled()

    def alive(self):
        """Fails with what the studio said where it has ended: after a fault also the calls that led there."""
        status = self.process.poll()
        if status is not None:
            ended = signal.Signals(-status).name if status < 0 else status
            raise AssertionError(f"the studio ended with {ended}: {self.said()[-8000:]}")

    def _find_app(self):
        self.alive()
        top = pyatspi.Registry.getDesktop(0)
        for i in range(top.childCount):
            try:
                app = top.getChildAtIndex(i)
                if app is not None and app.get_process_id() == self.pid:
                    return app
            except Exception:
                pass  # another program's, on its way out
        return None

    def said(self):
        """Standard output and error so far."""
        return self.errors.read_text(errors="replace")

    # ---- the accessibility tree

    def all(self, ok, root=None):
        """All objects that are as wanted, parents first. Those that vanish while we look are passed over."""
        stack = [root or self.app]
        while stack:
            o = stack.pop()
            try:
                if o is None:
                    continue
                if ok(o):
                    yield o
                stack += reversed(children(o))
            except Exception:
                pass

    def showing(self, name, role=None, root=None):
        """All showing objects of a name; labels only when asked for."""
        return list(self.all(lambda o: o.name == name and shows(o) and
                             (o.getRoleName() == role if role else o.getRoleName() != "label"), root))

    def find(self, name, role=None, root=None, patience=PATIENCE):
        """The showing object of a name. Where it was found before, it is looked for there first."""
        known = self._known.get((name, role))
        try:
            if root is None and known is not None and known.name == name and shows(known):
                return known
        except Exception:
            pass  # it is gone
        def look():
            found = self.showing(name, role, root)
            if not found:
                self.alive()
            return found
        found = wait(f"{name!r} ({role or 'any role'}) on the screen", look, patience, 0.05)[0]
        if root is None:
            self._known[name, role] = found
        return found

    def asked(self, name, role, question):
        """What the showing object of a name answers. One that goes while it is asked, for the window puts another in its place,
        is looked for again."""
        def answer():
            control = self.find(name, role)
            try:
                return [question(control)]
            except Exception:
                self._known.clear()
                self.alive()
                return None
        return wait(f"an answer of {name!r}", answer, rest=0.05)[0]

    def press(self, name, role=None):
        """The control's own action: as a screen reader would."""
        control = self.find(name, role)
        action = control.queryAction()
        names = [action.getName(i) for i in range(action.nActions)]
        best = next((i for word in ("Press", "Toggle", "Trigger") for i, n in enumerate(names) if n == word), None)
        assert best is not None, f"{name!r} has no action but {names}"
        action.doAction(best)
        return control

    def click(self, name, role=None):
        """In the middle of the control, with the mouse."""
        x, y, width, height = self.asked(name, role, rect)
        self.hand.click(x + width // 2, y + height // 2)

    def type_into(self, name, text):
        """The text into a field, once it has the keys, in place of what is there. A list of proposals that comes up between two
        letters can take some of them: it is typed again until it stands."""
        wait(f"the keys in {name!r}", lambda: self.asked(name, "text", lambda o: o.getState().contains(pyatspi.STATE_FOCUSED)))

        def stands():
            self.hand.keys("Control_L+a")
            self.hand.write(text)
            return steady(lambda: self.asked(name, "text", lambda o: o.queryText().getText(0, -1)), 0.05) == text
        wait(f"{text!r} in {name!r}", stands)

    def described(self, name, role=None):
        return self.asked(name, role, lambda o: o.description)

    def tree(self):
        """The showing part of the tree, for people."""
        lines = []

        def tell(o, depth):
            try:
                if depth and not shows(o):
                    return
                lines.append(f"{'  ' * depth}{o.getRoleName()} {o.name!r} {o.description!r} {rect(o) if depth else self.pid}")
                for i in range(o.childCount):
                    tell(o.getChildAtIndex(i), depth + 1)
            except Exception:
                pass
        tell(self.app, 0)
        return "\n".join(lines)

    # ---- the viewport

    def viewport(self):
        return self.asked("Viewport", None, rect)

    def pixel(self, u, v):
        """The screen pixel at fractions of the viewport, from its upper left corner."""
        x, y, width, height = self.viewport()
        return x + round(u * (width - 1)), y + round(v * (height - 1))

    def middle(self, share=0.5):
        """A rectangle around the middle of the viewport: the model without what is painted over its corners."""
        x, y, width, height = self.viewport()
        w, h = int(width * share), int(height * share)
        return x + (width - w) // 2, y + (height - h) // 2, w, h

    def hands_off(self):
        """The pointer leaves the viewport: no ring is painted over the picture."""
        x, y, width, _ = self.viewport()
        self.hand.at(x + width // 2, max(y - 4, 0))

    def settled(self, revision=0, mark=0, samples=None):
        """Waits for a picture of at least this revision, drawn since the mark, and returns its event: the final one, after which
        nothing more is drawn, or the first of at least so many samples, which with 1 shows the revision whole."""
        samples = samples or _final

        def stands():
            self.alive()
            frame = next((f for f in reversed(self.log.since(mark, "frame"))), None)
            if frame is None or frame["revision"] < revision or frame["samples"] < samples:
                return None
            return frame if self.described("Viewport").startswith("ready, frame") else None
        return wait(f"a picture of revision {revision} with {samples} samples", stands)

    def drag(self, *points, button=1, hertz=250, steps=60, keys=()):
        """A press at the first of the points (fractions of the viewport), a way through them, a release."""
        way = along([self.pixel(*point) for point in points], steps)
        self.hand.at(*way[0])
        for key in keys:
            self.hand.hold_key(key)
        self.hand.down(button)
        self.hand.path(way[1:], hertz)
        self.hand.up(button)
        for key in keys:
            self.hand.release_key(key)

    def stroke(self, *points, samples=None, **how):
        """drag(), and the event of the stroke that it made. If it changed the model, its picture then stands, without the ring:
        see settled(); with 0 samples nobody waits for it."""
        mark = self.log.mark()
        self.drag(*points, **how)
        made = self.log.wait("stroke", mark)
        if made["changed"]:
            self.log.wait("history", mark)
        if samples != 0:
            self.hands_off()
            self.settled(made["revision"], mark if made["changed"] else 0, samples)
        return made

    def around(self, *points, margin=60):
        """The rectangle of the screen around places in the viewport, fractions of it."""
        pixels = [self.pixel(*point) for point in points]
        left, top = min(p[0] for p in pixels) - margin, min(p[1] for p in pixels) - margin
        return left, top, max(p[0] for p in pixels) + margin - left, max(p[1] for p in pixels) + margin - top

    def picture(self, area=None):
        return self.hand.grab(area or self.middle())

    # ---- its window

    def windows(self):
        """The numbers of the studio's visible windows."""
        return subprocess.run(["xdotool", "search", "--onlyvisible", "--pid", str(self.pid)], capture_output=True, text=True,
                              timeout=60).stdout.split()

    def dialogs(self):
        """Visible windows beside the main one: dialogs, menus."""
        return [window for window in self.windows() if window != self.main]

    def window(self, verb, *words):
        """xdotool's verb for the main window: windowminimize, windowsize W H."""
        options = [word for word in words if word == "--sync"]
        subprocess.run(["xdotool", verb, *options, self.main, *(str(word) for word in words if word != "--sync")],
                       capture_output=True, timeout=60)

    def to_front(self):
        """Also where it was minimised."""
        if self.process.poll() is None:
            self.window("windowmap")
            self.window("windowactivate", "--sync")

    def dismissed(self):
        """One Escape for the newest dialog or menu; True once there is none."""
        self.alive()
        dialogs = self.dialogs()
        if dialogs:  # a click beside it may have taken the keys from it
            subprocess.run(["xdotool", "windowactivate", dialogs[-1]], capture_output=True, timeout=60)
            self.hand.keys("Escape")
        return not dialogs

    @contextlib.contextmanager
    def stopped(self):
        """The whole process stands still."""
        os.kill(self.pid, signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(self.pid, signal.SIGCONT)

    # ---- its end

    def close(self):
        """As a person does: the window is asked to close. True where the studio ended with 0."""
        self.to_front()
        self.hand.keys("Alt_L+F4")
        try:
            return self.process.wait(PATIENCE) == 0
        except subprocess.TimeoutExpired:
            self.kill()
            return False

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()


_running = []  # studios, the newest last
_hand = None


def hand():
    global _hand
    if _hand is None:
        _hand = Hand()
    return _hand


def children(o):
    """The children of an object. Each is asked for by itself, and the windows of an application have another order as soon as
    a widget is made: then one comes twice and another not at all, and they are asked for again."""
    for _ in range(20):
        found = [o.getChildAtIndex(i) for i in range(o.childCount)]
        if len(set(found)) == len(found):
            break
    return list(dict.fromkeys(found))


def shows(o):
    return o.getState().contains(pyatspi.STATE_SHOWING)


def checked(o):
    return o.getState().contains(pyatspi.STATE_CHECKED)


def rect(o):
    """(x, y, width, height) on the screen."""
    extents = o.queryComponent().getExtents(pyatspi.DESKTOP_COORDS)
    return extents.x, extents.y, extents.width, extents.height


def along(corners, steps):
    """A way through the corners in about so many steps, evenly by length."""
    lengths = [math.dist(a, b) for a, b in zip(corners, corners[1:])]
    total = sum(lengths) or 1
    way = [corners[0]]
    for a, b, length in zip(corners, corners[1:], lengths):
        count = max(1, round(steps * length / total))
        way += [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(1, count + 1)]
    return way


class Case(unittest.TestCase):
    """A test of the studio; of a failing one, keep() leaves what was there."""

    def setUp(self):
        self.started_at = time.monotonic()

    def tearDown(self):
        hand().let_go()


class OneStudio(Case):
    """Tests that share a studio with a model of their own."""

    @classmethod
    def setUpClass(cls):
        cls.file = model()
        cls.studio = Studio(cls.file)

    @classmethod
    def tearDownClass(cls):
        cls.studio.close()


def keep(name):
    """Picture of the screen, event log, accessibility tree and standard error of the newest studio, for people."""
    place = KEPT / name
    place.mkdir(parents=True, exist_ok=True)
    try:
        hand().grab().write_png(place / "screen.png")
        if _running:
            studio = _running[-1]
            shutil.copyfile(studio.errors, place / "output.txt")
            if studio.log.file.exists():
                shutil.copyfile(studio.log.file, place / "events.jsonl")
            (place / "tree.txt").write_text(studio.tree())
    except Exception as e:  # the failure itself is to be told, not this one
        print(f"not all was kept: {e}", file=sys.stderr)
    print(f"kept in {place}", file=sys.stderr)


class _Result(unittest.TextTestResult):
    def addError(self, test, err):
        keep(test.id())
        super().addError(test, err)

    def addFailure(self, test, err):
        keep(test.id())
        super().addFailure(test, err)

    def addSubTest(self, test, subtest, err):
        if err is not None:
            keep(subtest.id().replace("/", "-")[:120])
        super().addSubTest(test, subtest, err)

    def stopTest(self, test):
        if hasattr(test, "started_at"):  # not where its class was skipped
            self.stream.write(f"[{time.monotonic() - test.started_at:.1f} s] ")
        super().stopTest(test)


def measured(what, figure, goal):
    """A figure beside its goal: told, never asserted, for the machine may be busy."""
    print(f"\n  measured: {what}: {figure}   (goal: {goal})", file=sys.stderr)


def main():
    """Runs the tests of the program; every studio is ended with it."""
    try:
        unittest.main(verbosity=2, testRunner=unittest.TextTestRunner(resultclass=_Result, verbosity=2))
    finally:
        for studio in _running:
            studio.kill()
