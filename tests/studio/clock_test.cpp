// A servo on a clock of its own beside a window at work: which of its ticks had to wait for something, and which were
// lost. The device calls its servo, so that no due time of this machine comes into it; what the machine does to due
// times is printed by hand_test.py.
#include "opened.h"
#include "support/folder.h"
#include "support/shells.h"

#include <gtest/gtest.h>
#include <studio/accessible.h>
#include <studio/desktop_scheme.h>
#include <studio/hand.h>
#include <studio/main_window.h>
#include <studio/text.h>
#include <sys/resource.h>

#include <QAction>
#include <QMouseEvent>
#include <QSettings>
#include <QSignalSpy>
#include <QTest>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace relief::studio {
namespace {

constexpr int kPatience = 60'000;       // ms, on a machine that is busy with other things
constexpr std::uint64_t kTicks = 3000;  // of the virtual clock, beside the window
constexpr std::uint64_t kAhead = 2000;  // ticks that the window may be behind; it has room for HandMonitor::kWaiting
constexpr std::chrono::microseconds kPause{200};  // from one tick to the next: the clock runs five times as fast
constexpr std::uint64_t kWarmUp = 200;            // ticks in which memory is touched for the first time

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // it has locks of its own, for which a tick may wait
#else
constexpr bool kSanitized = false;
#endif

/// How often the calling thread gave the processor away because it had to wait: for a lock, a file, memory. That
/// another one took it away is not among them.
long waits_so_far() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

/// What the test and the device's thread tell each other.
struct Clock {
  std::atomic<std::uint64_t> ticks{0};          ///< that were answered
  std::atomic<std::uint64_t> late{0};           ///< in which the thread had to wait
  std::atomic<std::uint64_t> forces{0};         ///< that were answered with a force
  std::atomic<std::uint64_t> taken{0};          ///< that the window has, or misses
  std::atomic<std::uint64_t> hurries_until{0};  ///< up to that tick without a pause; unless 0, no window is waited for
  // The control: a tick that needs what the window holds.
  std::atomic<bool> needs{false}, asks{false};
  std::mutex held;
};

/// Its millisecond is over when the servo has answered.
class VirtualDevice final : public HapticDevice {
 public:
  VirtualDevice(std::shared_ptr<Clock> clock, HandScript script)
      : clock_(std::move(clock)), script_(std::move(script)) {
    info_.pull = false;
  }
  ~VirtualDevice() override { stop(); }
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] bool start(PushTick tick) noexcept override {
    thread_ = std::thread([this, tick] {
      for (std::uint64_t k = 0; !stopped_; ++k) {
        answered(tick, k);
        if (k < clock_->hurries_until) continue;
        do std::this_thread::sleep_for(kPause);
        while (!stopped_ && clock_->hurries_until == 0 && k > clock_->taken + kAhead);
      }
      static_cast<void>(tick(reading(clock_->ticks)));
    });
    return true;
  }
  void stop() noexcept override {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  [[nodiscard]] DeviceState reading(std::uint64_t k) const {
    DeviceState state;
    state.t = 1e-3 * static_cast<double>(k);
    state.position = script_(state.t).position;
    return state;
  }
  void answered(PushTick tick, std::uint64_t k) {
    const DeviceState now = reading(k);
    const long before = waits_so_far();
    const Wrench wrench = tick(now);
    if (clock_->needs) {
      clock_->asks = true;
      const std::scoped_lock lock(clock_->held);
      clock_->asks = false;
    }
    const bool waited = waits_so_far() != before;
    if (waited && k >= kWarmUp) ++clock_->late;
    if (length(wrench.force) > 0) ++clock_->forces;
    clock_->ticks = k + 1;
  }

  std::shared_ptr<Clock> clock_;
  HandScript script_;
  DeviceInfo info_;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

class ClockTest : public ::testing::Test {
 protected:
  ClockTest() {
    install_accessibility();
    window.resize(1200, 800);
    open_in(window, folder, testing::sphere_shell(3, 16));
    hand().open_devices_with(
        [clock = clock](const std::string&, HandScript script) -> Result<std::unique_ptr<HapticDevice>> {
          // As nimble as the clock, beside the calm that people want to see.
          return std::make_unique<VirtualDevice>(
              clock, [script = std::move(script)](double t) { return script ? script(5 * t) : HandTarget{}; });
        });
    QObject::connect(&hand(), &Hand::ticked, &window,
                     [this] { clock->taken = hand().monitor().taken() + hand().monitor().missing(); });
    window.use_device("virtual");
  }

  template <typename Condition>
  [[nodiscard]] static bool comes(Condition&& condition) {
    return QTest::qWaitFor(condition, kPatience);
  }
  [[nodiscard]] Hand& hand() { return *window.findChild<Hand*>(); }

  void mouse(QEvent::Type type, QPointF at) {
    const Qt::MouseButton button = type == QEvent::MouseMove ? Qt::NoButton : Qt::LeftButton;
    const Qt::MouseButtons down = type == QEvent::MouseButtonRelease ? Qt::NoButton : Qt::LeftButton;
    QMouseEvent event(type, at, at, button, down, Qt::NoModifier);
    QCoreApplication::sendEvent(&window.viewport(), &event);
  }
  /// A stroke, its undoing every other time, a turn of the camera, and all the pictures that come of them.
  void work(int k) {
    const QPointF middle(window.viewport().width() * 0.5, window.viewport().height() * 0.5);
    const QPointF from = middle + QPointF(7.0 * (k % 9) - 28, 5.0 * (k % 7) - 15);
    mouse(QEvent::MouseButtonPress, from);
    for (int step = 1; step <= 20; ++step) {
      mouse(QEvent::MouseMove, from + QPointF(2 * step, step));
      QCoreApplication::processEvents();
    }
    mouse(QEvent::MouseButtonRelease, from + QPointF(40, 20));
    if (k % 2 == 1) window.findChild<QAction*>("undo")->trigger();
    Camera camera = window.viewport().camera();
    window.viewport().set_camera(orbit(camera, k % 4 < 2 ? 0.05 : -0.05, 0, true));
    QCoreApplication::processEvents();
  }

  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
  std::shared_ptr<Clock> clock = std::make_shared<Clock>();
  MainWindow window{settings, desktop};
};

TEST_F(ClockTest, NoTickWaitsForTheWindowAndNoneIsLost) {
  window.findChild<QAction*>("tool-carve")->trigger();
  const QSignalSpy drawn(&window.viewport(), &Viewport::frameDrawn);
  const quint64 before = window.viewport().scene().model->number();
  QElapsedTimer patience;
  patience.start();
  int done = 0;
  while ((clock->ticks < kTicks || clock->forces < kTicks / 10 || drawn.size() < 10 || done < 10) &&
         patience.elapsed() < kPatience)
    work(done++);
  EXPECT_GE(clock->ticks, kTicks);
  EXPECT_GE(clock->forces, kTicks / 10) << "the hand feels the surface";
  EXPECT_GE(drawn.size(), 10) << "the window draws";
  EXPECT_TRUE(comes([&] { return window.viewport().scene().model->number() > before + 10; })) << "it sculpts";
  const std::uint64_t seen = clock->ticks;
  EXPECT_TRUE(comes([&] { return hand().monitor().taken() >= seen; }));
  EXPECT_EQ(hand().monitor().missing(), 0U);
  if (kSanitized)
    RecordProperty("late", static_cast<int>(clock->late));
  else
    EXPECT_EQ(clock->late, 0U) << "of " << clock->ticks;
}

TEST_F(ClockTest, ATickThatNeedsWhatTheWindowHoldsIsLate) {
  ASSERT_TRUE(comes([&] { return clock->ticks > kWarmUp; }));
  const std::uint64_t late = clock->late;
  // Again where the device's thread was not given the processor meanwhile.
  EXPECT_TRUE(comes([&] {
                const std::scoped_lock holds(clock->held);
                clock->needs = true;
                while (!clock->asks) std::this_thread::yield();
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
                clock->needs = false;
                return clock->late > late;
              }) ||
              comes([&] { return clock->late > late; }));
}

TEST_F(ClockTest, TicksThatNobodyTakesAreCounted) {
  ASSERT_TRUE(comes([&] { return hand().monitor().taken() > 0; }));
  const std::uint64_t end = clock->ticks + 2 * HandMonitor::kWaiting + 4096;
  clock->hurries_until = end;
  while (clock->ticks < end) std::this_thread::yield();  // the window stands still
  EXPECT_TRUE(comes([&] { return hand().monitor().missing() > 0; }));
}

}  // namespace
}  // namespace relief::studio
