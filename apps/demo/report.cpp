#include "report.h"

#include "plots/plot.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <string_view>

namespace relief::demo {

namespace {

using plots::escaped;
using plots::histogram;
using plots::row;
using plots::times_row;

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 3; ++i)
      word = (word << 8U) | (k + i < bytes.size() ? static_cast<unsigned char>(bytes[k + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i) out += k + i <= bytes.size() ? kAlphabet[(word >> (18 - 6 * i)) & 63U] : '=';
  }
  return out;
}

std::string force_trace(const std::vector<ServoSample>& trace) {
  if (trace.size() < 2) return "<p>No sample reached the trace.</p>";
  const double t0 = trace.front().t;
  plots::Envelope force(std::max(trace.back().t - t0, 1e-3));
  static constexpr std::array<std::string_view, 6> kStrip = {"#c9c4bb", "#b5532d", "#3f7d58",
                                                             "#5b3a29", "#c79a3b", "#b03a2e"};
  for (const ServoSample& s : trace) force.add(s.t - t0, length(s.force));
  // The strip shows what the button did.
  return plots::trace(force, "time, s (strip: touching, carving, building, painting)", "force on the hand, N",
                      [&](std::size_t column) -> std::string_view {
                        const ServoSample& s = trace[column * trace.size() / plots::Envelope::kColumns];
                        if ((s.buttons & 1U) != 0) return kStrip[1 + std::min<std::size_t>(s.buttons >> 8U, 4)];
                        return s.contact ? kStrip[0] : "";
                      });
}

}  // namespace

Status write_report(const Report& r, const std::filesystem::path& file) {
  const ConvertReport& c = r.conversion;
  const SessionStats& s = r.stats;
  std::string html = fmt::format(
      "<p>{}: converted, felt, carved and painted by a simulated hand while it was drawn; saved, and read back {}.</p>",
      escaped(r.model_name), r.reload_identical ? "bit for bit the same" : "<b>with differences</b>");

  html += "<div class=\"pair\">";
  for (const Figure& f : r.figures) {
    std::ifstream stream(f.png, std::ios::binary);
    const std::string png{std::istreambuf_iterator<char>(stream), {}};
    html +=
        fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
                    escaped(f.caption), base64(png));
  }
  html += "</div>";

  const double fibres = static_cast<double>(std::max<std::size_t>(1, c.fibres_cast));
  html += "<h2>Conversion</h2><table>";
  html += row("source", fmt::format("{} triangles", c.source_triangles));
  html += row("slabs", fmt::format("{}", c.slabs));
  html += row("fibres cast", fmt::format("{}", c.fibres_cast));
  html += row("fibres that met the surface once / never / several times",
              fmt::format("{:.2f} % / {:.2f} % / {:.2f} %", 100.0 * static_cast<double>(c.hits_single) / fibres,
                          100.0 * static_cast<double>(c.hits_none) / fibres,
                          100.0 * static_cast<double>(c.hits_several) / fibres));
  html += row("distance to the mended source and back, share of the diagonal",
              fmt::format("rms {:.1e}, max {:.1e}; rms {:.1e}, max {:.1e}", c.to_mended.rms, c.to_mended.max,
                          c.from_mended.rms, c.from_mended.max));
  html += row("fibre length, share of the diagonal",
              fmt::format("least {:.1e}, median {:.1e}", c.thickness_min, c.thickness_median));
  html += row("CPU time, all threads", fmt::format("{:.2f} s", r.convert_seconds));
  for (const auto& phase : c.phases)
    html += row("&nbsp;&nbsp;" + escaped(phase.name), fmt::format("{:.3f} s", phase.seconds));
  html += "</table>";

  html += "<h2>Force</h2>" + force_trace(r.trace);
  html += fmt::format(
      "<p>Largest force {:.2f} N, at most {:.0f} ms at a time at the device's own limit; {} of {} ticks in "
      "contact.</p>",
      r.force_max, 1e3 * r.stuck_for, s.contact_samples, s.samples);

  html +=
      "<h2>Servo, 1 kHz</h2><p class=\"key\">The null loop sleeps to the same schedule at the same time and does "
      "nothing "
      "else: what it shows is the machine.<span style=\"background:#c96f2e\"></span>servo<span "
      "style=\"background:#8fa3b0\"></span>null loop</p>";
  html += histogram(s.servo.period, &r.null_loop.period, "period from wake-up to wake-up");
  html += histogram(s.servo.compute, &r.null_loop.compute, "CPU time of one tick (device, query, force law)");
  html += "<table>";
  html += plots::kTimesHead;
  html += times_row("period", s.servo.period) + times_row("period, null loop", r.null_loop.period);
  html += times_row("late", s.servo.late) + times_row("late, null loop", r.null_loop.late);
  html += times_row("CPU per tick", s.servo.compute) +
          times_row("CPU per dab with undo and publishing", r.edits.dab_time) + "</table>";
  html += fmt::format(
      "<p>{} ticks, {} periods skipped, {} samples dropped. {}</p>", s.servo.ticks, s.servo.overruns, s.servo.dropped,
      s.servo.note.empty() ? std::string("Real-time priority and locked memory were granted.") : escaped(s.servo.note));

  html += "<h2>Editing and drawing, meanwhile</h2><table>";
  html += row("strokes / dabs", fmt::format("{} / {}", r.edits.strokes, r.edits.dabs));
  html += row("samples edited", fmt::format("{}", r.edits.samples));
  html += row("samples that the clay or its room did not let go further", fmt::format("{}", r.edits.limited));
  html += row("frames drawn while the servo ran", fmt::format("{} of {} triangles, {:.0f} ms of CPU each (median)",
                                                              r.frames, r.frame_triangles, r.frame_cpu_seconds * 1e3));
  html += "</table>";

  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(plots::page(r.title, html)));
  return out.commit();
}

}  // namespace relief::demo
