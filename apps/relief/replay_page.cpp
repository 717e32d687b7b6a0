#include "replay_page.h"

#include "commands.h"
#include "plots/plot.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fmt/format.h>

#include <algorithm>

namespace relief::cli {

namespace {

using plots::Envelope;
using plots::escaped;

constexpr std::size_t kWorst = 20;

struct Worst {
  std::uint64_t number = 0;
  RecordedTick tick;
  [[nodiscard]] bool worse_than(const Worst& other) const noexcept {
    return tick.sample.compute_ns != other.tick.sample.compute_ns
               ? tick.sample.compute_ns > other.tick.sample.compute_ns
               : number < other.number;
  }
};

/// J that the force of a tick did on the hand until the next. The force is along the model's axes, the way along the
/// device's.
double work_between(const RecordedTick& tick, const RecordedTick& next, const Replay& replay) {
  const Workspace space = replay.settings()[tick.settings].workspace.with_unit_rotation();
  return dot(space.turned_to_device(tick.sample.force), next.sample.device - tick.sample.device);
}

std::string worst_table(const std::vector<Worst>& worst) {
  std::string html =
      "<table><tr class=\"head\"><th>tick</th><th>t, s</th><th>compute, µs</th><th>late, µs</th><th>force, N</th>"
      "<th>depth, units</th><th>slab</th><th>flags</th></tr>";
  for (const Worst& w : worst) {
    const ServoSample& s = w.tick.sample;
    html += fmt::format(
        "<tr><td>{}</td><td>{:.3f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.3f}</td><td>{:.4g}</td><td>{}</td>"
        "<td>{}</td></tr>",
        w.number, s.t, s.compute_ns * 1e-3, s.late_ns * 1e-3, length(s.force), s.depth,
        s.contact ? fmt::format("{}", s.at.slab) : "", joined(flag_names(s.flags)));
  }
  return html + "</table>";
}

}  // namespace

Status write_replay_page(Replay& replay, const std::filesystem::path& file) {
  const Recording& recording = replay.recording();
  const double end =
      recording.runs().empty() ? 1 : static_cast<double>(recording.runs().back().first + recording.runs().back().count);
  Envelope force(end), depth(end), work(end), leak(end);
  TimeHistogram compute, late;
  std::vector<Worst> worst;
  std::uint64_t contact = 0, flagged = 0;
  double force_max = 0, depth_max = 0, done = 0;
  std::optional<Worst> before;

  replay.rewind();
  for (Worst now;;) {
    RELIEF_TRY(const bool more, replay.next(now.number, now.tick));
    if (!more) break;
    const ServoSample& s = now.tick.sample;
    const auto x = static_cast<double>(now.number);
    force.add(x, length(s.force));
    depth.add(x, s.depth);
    // A force is held until the next tick, while the hand moves on.
    if (before && before->number + 1 == now.number)
      if (const double share = work_between(before->tick, now.tick, replay); std::isfinite(share)) done += share;
    work.add(x, done * 1e3);
    leak.add(x, s.leak * 1e3);
    if (s.compute_ns != 0) compute.add(s.compute_ns);
    late.add(s.late_ns);
    contact += s.contact ? 1U : 0U;
    flagged += s.flags != 0 ? 1U : 0U;
    force_max = std::max(force_max, length(s.force));
    depth_max = std::max(depth_max, s.depth);
    if (worst.size() < kWorst || now.worse_than(worst.back())) {
      const auto place = std::ranges::find_if(worst, [&](const Worst& w) { return now.worse_than(w); });
      worst.insert(place, now);
      if (worst.size() > kWorst) worst.pop_back();
    }
    before = now;
  }

  std::string html = "<table>";
  for (const auto& [key, value] : recording.head().facts)
    html += plots::row(escaped(printable(key, 60)), escaped(printable(value, 400)));
  const ServoSettings& s = replay.settings().front();
  html += plots::row(
      "settings",
      fmt::format("stiffness {} N/m, damping {} N·s/m, friction {} ({} at rest){}{}{}; {} changes", s.force.stiffness,
                  s.force.damping, s.force.friction, std::max(s.force.friction, s.force.static_friction),
                  s.force.exact_normals ? ", exact normals" : "", s.force.paper_contact ? ", the paper's contact" : "",
                  s.force.guard ? ", guarded" : "", replay.settings().size() - 1));
  html += plots::row("ticks", fmt::format("{}, {} in contact, {} flagged; {} gaps", recording.tick_count(), contact,
                                          flagged, recording.runs().empty() ? 0 : recording.runs().size() - 1));
  html += "</table><h2>Force</h2>" + plots::trace(force, "tick", "force on the hand, N");
  html += fmt::format("<p>Largest {:.3f} N.</p><h2>Depth</h2>", force_max);
  html += plots::trace(depth, "tick", "depth, model units");
  html += fmt::format("<p>Deepest {:.4g} model units.</p><h2>Work</h2>", depth_max);
  html += plots::trace(work, "tick", "work done on the hand, mJ");
  html += fmt::format(
      "<p>Sum of force times way, each force held to the next tick: {:.3g} mJ at the end. Below zero the hand gave "
      "more "
      "than it got back; what stays above zero after the hand has left was made by the rendering.</p>",
      done * 1e3);
  html += plots::trace(leak, "tick", "leak, mJ");
  html +=
      "<p>What the servo itself counted as energy that came from nowhere lately; it damps against it.</p><h2>Time</h2>";
  html += plots::histogram(compute, nullptr, "CPU time of one tick");
  html += "<table>";
  html += plots::kTimesHead;
  html += plots::times_row("CPU per tick", compute) + plots::times_row("late", late) + "</table>";
  html += "<h2>The worst ticks</h2><p>Those that took the most CPU time.</p>" + worst_table(worst);

  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(plots::page("Recording " + printable(recording.file().filename().string(), 80), html)));
  return out.commit();
}

}  // namespace relief::cli
