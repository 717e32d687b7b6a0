// A hand at the mouse and keys of an X server, and an eye on its screen, for tests that drive a program from outside.
// Reads one command a line from standard input and answers each with one line:
//
//   at X Y                      the pointer goes there
//   path HZ X Y X Y ...         one motion per point, paced; HZ 0: all at once
//   down B | up B               mouse button; 4 and 5 are the wheel
//   keys NAME+ NAME- ...        keys go down (+) and up (-), by their X names: Escape+ Escape- Control_L+ z+ z-
//   Control_L- grab X Y W H FILE           the pixels of a rectangle, 32 bits each (0x00RRGGBB of this machine), row by
//   row hold X Y W H                remember a rectangle until MS                    wait until the remembered
//   rectangle looks otherwise drop X Y FILE               a file manager lets a file fall there (XDND 5)
//
// Answers: "ok T" or "same T", where T is the time in milliseconds (steady clock) at which it was done; path adds the
// longest wait between two motions. A command that is not understood, or a screen that is gone, ends the program
// with 1.
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point at) {
  return std::chrono::duration<double, std::milli>(at.time_since_epoch()).count();
}

struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
};

std::istream& operator>>(std::istream& in, Rect& rect) { return in >> rect.x >> rect.y >> rect.width >> rect.height; }

class Hand {
 public:
  explicit Hand(Display* display) : display_(display) {}

  /// The answer to one line; empty where it is not understood.
  std::string answer(const std::string& line) {
    std::istringstream in(line);
    std::string word;
    in >> word;
    if (word == "at") return at(in);
    if (word == "path") return path(in);
    if (word == "down" || word == "up") return button(in, word == "down");
    if (word == "keys") return keys(in);
    if (word == "grab") return grab(in);
    if (word == "hold") return hold(in);
    if (word == "until") return until(in);
    if (word == "drop") return drop(in);
    return {};
  }

 private:
  static std::string told(const char* what, Clock::time_point at = Clock::now()) {
    std::ostringstream out;
    out << what << ' ' << std::fixed << milliseconds(at);
    return out.str();
  }

  /// When the server has it.
  Clock::time_point sent() {
    XSync(display_, False);
    return Clock::now();
  }

  std::string at(std::istream& in) {
    int x = 0, y = 0;
    if (!(in >> x >> y)) return {};
    const Clock::time_point begun = Clock::now();
    XTestFakeMotionEvent(display_, -1, x, y, CurrentTime);
    sent();
    return told("ok", begun);
  }

  std::string path(std::istream& in) {
    double hertz = 0;
    if (!(in >> hertz)) return {};
    std::vector<int> numbers;
    for (int n = 0; in >> n;) numbers.push_back(n);
    const Clock::time_point begun = Clock::now();
    Clock::time_point last = begun;
    double longest = 0;
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      if (hertz > 0) {
        const std::chrono::duration<double> since(static_cast<double>(i / 2) / hertz);
        std::this_thread::sleep_until(begun + std::chrono::duration_cast<Clock::duration>(since));
      }
      XTestFakeMotionEvent(display_, -1, numbers[i], numbers[i + 1], CurrentTime);
      XFlush(display_);
      const Clock::time_point now = Clock::now();
      longest = std::max(longest, milliseconds(now) - milliseconds(last));
      last = now;
    }
    return told("ok", sent()) + ' ' + std::to_string(longest);
  }

  std::string button(std::istream& in, bool down) {
    unsigned number = 0;
    if (!(in >> number)) return {};
    const Clock::time_point begun = Clock::now();
    XTestFakeButtonEvent(display_, number, down ? True : False, CurrentTime);
    sent();
    return told("ok", begun);
  }

  std::string keys(std::istream& in) {
    const Clock::time_point begun = Clock::now();
    for (std::string word; in >> word;) {
      const bool down = word.back() == '+';
      if (!down && word.back() != '-') return {};
      word.pop_back();
      const KeyCode code = XKeysymToKeycode(display_, XStringToKeysym(word.c_str()));
      if (code == 0) return {};
      XTestFakeKeyEvent(display_, code, down ? True : False, CurrentTime);
      sent();
      // A key that is up and down again in the same millisecond of the server is taken for one that repeats.
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return told("ok", begun);
  }

  std::vector<std::uint32_t> pixels(const Rect& rect) {
    XImage* image = XGetImage(display_, DefaultRootWindow(display_), rect.x, rect.y, static_cast<unsigned>(rect.width),
                              static_cast<unsigned>(rect.height), AllPlanes, ZPixmap);
    std::vector<std::uint32_t> words;
    if (image == nullptr) return words;
    words.reserve(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
    for (int y = 0; y < rect.height; ++y) {
      const auto* row = reinterpret_cast<const std::uint32_t*>(image->data + y * image->bytes_per_line);
      for (int x = 0; x < rect.width; ++x) words.push_back(row[x] & 0xffffffU);
    }
    XDestroyImage(image);
    return words;
  }

  std::string grab(std::istream& in) {
    Rect rect;
    std::string file;
    if (!(in >> rect >> std::ws) || !std::getline(in, file)) return {};
    const Clock::time_point begun = Clock::now();
    const std::vector<std::uint32_t> words = pixels(rect);
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(words.data()), static_cast<std::streamsize>(words.size() * 4));
    return out.good() && !words.empty() ? told("ok", begun) : std::string();
  }

  std::string hold(std::istream& in) {
    if (!(in >> held_)) return {};
    before_ = pixels(held_);
    return told("ok");
  }

  std::string until(std::istream& in) {
    double wait = 0;
    if (!(in >> wait) || before_.empty()) return {};
    const Clock::time_point begun = Clock::now();
    while (milliseconds(Clock::now()) - milliseconds(begun) < wait) {
      if (pixels(held_) != before_) return told("ok");
      std::this_thread::sleep_for(std::chrono::microseconds(300));  // leaves the core to whom we watch
    }
    return told("same");
  }

  // ---- Drag and drop, https://freedesktop.org/wiki/Specifications/XDND

  Atom atom(const char* name) { return XInternAtom(display_, name, False); }

  /// The topmost window at a place that takes drops; None where there is none.
  Window taker(int x, int y) {
    Window at = DefaultRootWindow(display_);
    for (Window child = at; child != None; at = child) {
      int inside_x = 0, inside_y = 0;
      if (at != DefaultRootWindow(display_) && takes_drops(at)) return at;
      XTranslateCoordinates(display_, DefaultRootWindow(display_), at, x, y, &inside_x, &inside_y, &child);
      if (child == None) return None;
    }
    return None;
  }

  bool takes_drops(Window window) {
    Atom type = None;
    int format = 0;
    unsigned long count = 0, left = 0;
    unsigned char* data = nullptr;
    XGetWindowProperty(display_, window, atom("XdndAware"), 0, 1, False, AnyPropertyType, &type, &format, &count, &left,
                       &data);
    if (data != nullptr) XFree(data);
    return type != None;
  }

  void tell(Window target, const char* what, long own, long a, long b, long c, long d) {
    XEvent event{};
    event.xclient = {.type = ClientMessage,
                     .serial = 0,
                     .send_event = True,
                     .display = display_,
                     .window = target,
                     .message_type = atom(what),
                     .format = 32,
                     .data = {.l = {own, a, b, c, d}}};
    XSendEvent(display_, target, False, NoEventMask, &event);
    XFlush(display_);
  }

  /// Gives the file's address to whoever asks, until the target says `word`; false after ten seconds.
  bool served_until(const char* word, const std::string& address) {
    const Clock::time_point begun = Clock::now();
    while (milliseconds(Clock::now()) - milliseconds(begun) < 10000) {
      if (XPending(display_) == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      XEvent event;
      XNextEvent(display_, &event);
      if (event.type == ClientMessage && event.xclient.message_type == atom(word)) return true;
      if (event.type == SelectionRequest) give(event.xselectionrequest, address);
    }
    return false;
  }

  void give(const XSelectionRequestEvent& request, const std::string& address) {
    XChangeProperty(display_, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(address.data()), static_cast<int>(address.size()));
    XEvent answer{};
    answer.xselection = {.type = SelectionNotify,
                         .serial = 0,
                         .send_event = True,
                         .display = display_,
                         .requestor = request.requestor,
                         .selection = request.selection,
                         .target = request.target,
                         .property = request.property,
                         .time = request.time};
    XSendEvent(display_, request.requestor, False, NoEventMask, &answer);
    XFlush(display_);
  }

  std::string drop(std::istream& in) {
    int x = 0, y = 0;
    std::string file;
    if (!(in >> x >> y >> std::ws) || !std::getline(in, file)) return {};
    const Window target = taker(x, y);
    if (target == None) return told("same");
    const Window own = XCreateSimpleWindow(display_, DefaultRootWindow(display_), 0, 0, 1, 1, 0, 0, 0);
    XSetSelectionOwner(display_, atom("XdndSelection"), own, CurrentTime);
    const std::string address = "file://" + file + "\r\n";
    const auto source = static_cast<long>(own);
    XTestFakeMotionEvent(display_, -1, x, y, CurrentTime);
    const Clock::time_point begun = Clock::now();
    tell(target, "XdndEnter", source, 5L << 24, static_cast<long>(atom("text/uri-list")), 0, 0);
    tell(target, "XdndPosition", source, 0, x << 16 | y, CurrentTime, static_cast<long>(atom("XdndActionCopy")));
    bool taken = served_until("XdndStatus", address);
    tell(target, "XdndDrop", source, 0, CurrentTime, 0, 0);
    taken = taken && served_until("XdndFinished", address);
    XDestroyWindow(display_, own);
    XSync(display_, False);
    return told(taken ? "ok" : "same", begun);
  }

  Display* display_;
  Rect held_;
  std::vector<std::uint32_t> before_;
};

}  // namespace

int main() {
  Display* display = XOpenDisplay(nullptr);
  if (display == nullptr) {
    std::cerr << "studio_hand: there is no X server at DISPLAY; start one and set it\n";
    return 1;
  }
  Hand hand(display);
  for (std::string line; std::getline(std::cin, line);) {
    const std::string answer = hand.answer(line);
    if (answer.empty()) {
      std::cerr << "studio_hand: not understood: " << line.substr(0, 200)
                << "; the head of hand.cpp lists the commands\n";
      return 1;
    }
    std::cout << answer << std::endl;
  }
  XCloseDisplay(display);
  return 0;
}
