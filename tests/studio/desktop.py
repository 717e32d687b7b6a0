"""A private desktop for one test program: X server, window manager, session bus, and folders of its own.

All of it is ended by its process numbers when the program ends, also what the buses started. Nothing of the person's own
desktop, settings or accessibility bus is seen or touched. start() comes before pyatspi is imported, for that connects.
"""

import atexit
import ctypes
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PROGRAMS = {"Xvfb": "xvfb", "openbox": "openbox", "dbus-daemon": "dbus-daemon"}
PR_SET_CHILD_SUBREAPER = 36  # what our children leave behind becomes ours, so that we can end it


class Desktop:
    """The desktop that start() made."""

    def __init__(self, folder, size):
        self.folder = folder
        self.width, self.height = size
        self.server = self.manager = self.bus = None


_desktop = None


def start(size=(1600, 1000)):
    """The desktop of this program, started where there is none yet."""
    global _desktop
    if _desktop is not None:
        return _desktop
    for program, package in PROGRAMS.items():
        if shutil.which(program) is None:
            sys.exit(f"the tests of the studio need {program}: apt-get install {package}, or tools/install-deps")
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    folder = pathlib.Path(tempfile.mkdtemp(prefix="relief-studio-"))
    _desktop = Desktop(folder, size)
    atexit.register(_stop)
    _set_environment(folder)
    _desktop.server, number = _told(
        ["Xvfb", "-displayfd", "{fd}", "-screen", "0", f"{size[0]}x{size[1]}x24", "-nolisten", "tcp", "-noreset", "-r"])
    os.environ["DISPLAY"] = ":" + number
    _desktop.bus, address = _told(["dbus-daemon", "--session", "--nofork", "--nopidfile", "--print-address={fd}"])
    os.environ["DBUS_SESSION_BUS_ADDRESS"] = address
    _desktop.manager = _started(["openbox", "--config-file", str(_openbox_settings(folder))])
    return _desktop


def _set_environment(folder):
    for name, below in {"XDG_RUNTIME_DIR": "run", "XDG_CONFIG_HOME": "config", "XDG_DATA_HOME": "data",
                        "XDG_STATE_HOME": "state", "XDG_CACHE_HOME": "cache", "HOME": "home"}.items():
        (folder / below).mkdir(mode=0o700)
        os.environ[name] = str(folder / below)
    os.environ.update(QT_QPA_PLATFORM="xcb", QT_LINUX_ACCESSIBILITY_ALWAYS_ON="1", QT_SCALE_FACTOR="1", LC_ALL="C.UTF-8",
                      NO_AT_BRIDGE="0", ATSPI_NO_CACHE="1", RELIEF_TEST_NAMES="1")
    for name in ("WAYLAND_DISPLAY", "XAUTHORITY", "AT_SPI_BUS_ADDRESS", "SESSION_MANAGER", "QT_STYLE_OVERRIDE"):
        os.environ.pop(name, None)


def _openbox_settings(folder):
    """Windows get the focus when they appear, and no key but Alt-F4 is the manager's own. No button of the mouse is: a manager
    that looks at each press first holds the pointer meanwhile, and on a busy machine some presses were never passed on."""
    settings = folder / "openbox.xml"
    settings.write_text("""<?xml version="1.0"?>
<openbox_config xmlns="http://openbox.org/3.4/rc">
  <focus><focusNew>yes</focusNew><followMouse>no</followMouse></focus>
  <desktops><number>1</number></desktops>
  <keyboard><keybind key="A-F4"><action name="Close"/></keybind></keyboard>
  <mouse></mouse>
</openbox_config>
""")
    return settings


def _started(command, **more):
    with open(_desktop.folder / (command[0] + ".log"), "wb") as log:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True, **more)


def _told(command):
    """The process, and the line that it writes into the descriptor {fd} once it is ready."""
    reading, writing = os.pipe()
    process = _started([word.replace("{fd}", str(writing)) for word in command], pass_fds=[writing])
    os.close(writing)
    with os.fdopen(reading) as answers:
        line = answers.readline().strip()
    if not line:
        sys.exit(f"{command[0]} did not start: " + (_desktop.folder / (command[0] + ".log")).read_text(errors="replace")[-500:])
    return process, line


def descendants():
    """The numbers of all processes that we and ours have started."""
    parent = {}
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError):
                pass  # it ended while we looked
    found, fresh = set(), {os.getpid()}
    while fresh:
        fresh = {pid for pid, its in parent.items() if its in fresh} - found
        found |= fresh
    return found


def _stop():
    for wish, patience in ((signal.SIGTERM, 3), (signal.SIGKILL, 3)):
        end = time.monotonic() + patience
        for pid in descendants():
            try:
                os.kill(pid, wish)
            except ProcessLookupError:
                pass
        while descendants() and time.monotonic() < end:
            try:
                if os.waitpid(-1, os.WNOHANG)[0] == 0:
                    time.sleep(0.01)
            except ChildProcessError:
                break
    shutil.rmtree(_desktop.folder, ignore_errors=True)
