#include "report.h"

#include "plots/plot.h"
#include "view_mesh.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>
#include <relief/core/query.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <string_view>

namespace relief::demo {

namespace {

using plots::escaped;
using plots::histogram;
using plots::row;
using plots::times_row;

/// Bytes of the page, so that it can be sent by mail.
constexpr std::size_t kMostBytes = 8'000'000;
/// Bytes of it that are neither pictures nor models: drawings, tables and the script.
constexpr std::size_t kRest = 400'000;

constexpr std::string_view kStyle = R"(
.sum{font-size:20px;font-weight:600}.pass{color:var(--good)}.warn{color:var(--odd)}.fail{color:var(--bad)}td.word{font-weight:700}
.why{font-size:14px;color:var(--soft);display:block}.flat{display:none}
canvas{width:100%;height:min(68vh,560px);display:block;background:var(--card);border:1px solid var(--line);border-radius:6px;cursor:grab;touch-action:pan-y}
canvas:active{cursor:grabbing}.bar{display:flex;flex-wrap:wrap;gap:8px;margin:10px 0}
button{font:inherit;color:var(--ink);background:var(--card);border:1px solid var(--line);border-radius:6px;min-width:44px;min-height:44px;padding:0 14px;cursor:pointer}
button[aria-pressed=true]{background:var(--ink);color:var(--page);border-color:var(--ink)}
)";

std::string class_of(Verdict verdict) {
  std::string text(name(verdict));
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// What the hand does, as the strip below the force shows it.
struct Doing {
  std::string_view text, colour;
};
constexpr Doing kFeeling = {"feeling", "#a59d92"};
constexpr Doing doing(Tool tool) {
  switch (tool) {
    case Tool::Carve:
      return {"carving", "#b5532d"};
    case Tool::Smooth:
      return {"smoothing", "#4a7fb5"};
    case Tool::Paint:
      return {"painting", "#c79a3b"};
    default:
      return {"building", "#3f7d58"};
  }
}

std::string key(std::string_view colour, std::string_view text) {
  return fmt::format("<span style=\"background:{}\"></span>{}", colour, text);
}

std::string force_trace(const Report& r) {
  const std::vector<ServoSample>& trace = r.trace;
  if (trace.size() < 2) return "<p>No tick was recorded.</p>";
  const double t0 = trace.front().t;
  plots::Envelope force(std::max(trace.back().t - t0, 1e-3));
  for (const ServoSample& s : trace) force.add(s.t - t0, length(s.force));
  const auto colour = [&](std::size_t column) -> std::string_view {
    const ServoSample& s = trace[column * trace.size() / plots::Envelope::kColumns];
    const std::uint32_t brush = s.buttons >> 8U;
    if ((s.buttons & 1U) != 0 && brush < r.tools.size()) return doing(r.tools[brush]).colour;
    return s.contact ? kFeeling.colour : "";
  };
  std::string legend = key(kFeeling.colour, kFeeling.text);
  for (const Tool tool : {Tool::Carve, Tool::Smooth, Tool::Deposit, Tool::Paint})
    if (std::ranges::find(r.tools, tool) != r.tools.end()) legend += key(doing(tool).colour, doing(tool).text);
  return fmt::format(
      "<figure><div class=\"wide\">{}</div><p class=\"key\">{}</p><figcaption>How hard the surface pushed back on the "
      "hand, from the first to the last second. The strip under the curve says what the hand was doing. The greatest "
      "force was {:.2f} N, about the weight of {:.0f} g. The hand touched the surface in {} of {} ticks.</figcaption>"
      "</figure>",
      plots::trace(force, "time, s", "force on the hand, N", colour), legend, r.force_max, r.force_max / 9.81e-3,
      r.stats.contact_samples, r.stats.samples);
}

std::string verdict_table(const std::vector<Claim>& claims) {
  std::string html =
      "<h2 id=\"verdict\">Verdict</h2><div class=\"wide\"><table class=\"verdict\"><tr class=\"head\"><th "
      "scope=\"col\">Claim</th><th scope=\"col\">Measured</th><th scope=\"col\">Limit</th><th "
      "scope=\"col\">Verdict</th>"
      "</tr>";
  for (const Claim& c : claims)
    html += fmt::format(
        "<tr id=\"claim-{}\"><th scope=\"row\">{}{}</th><td>{}</td><td>{:.4g} {}</td><td class=\"word "
        "{}\">{}</td></tr>",
        c.id, escaped(c.text), c.why.empty() ? "" : fmt::format("<span class=\"why\">{}</span>", escaped(c.why)),
        escaped(c.measured), c.limit, escaped(c.unit), class_of(c.verdict), name(c.verdict));
  return html + "</table></div>";
}

/// The 3D view and its data; empty where the model has too many slabs for the page.
std::string view(const Report& r, std::size_t bytes) {
  Box3d box = bounds_of_surface(*r.before);
  const Box3d later = bounds_of_surface(*r.after);
  box.add(later.low);
  box.add(later.high);
  const ViewMesh before = view_mesh(*r.before, box, bytes / 3), after = view_mesh(*r.after, box, bytes * 2 / 3);
  if (before.json.empty() || after.json.empty()) return {};
  const auto numbers = [](Vec3d v) { return fmt::format("[{:.9g},{:.9g},{:.9g}]", v.x, v.y, v.z); };
  std::string html =
      "<section id=\"view\" class=\"flat\"><h2>Turn it</h2><canvas tabindex=\"0\" role=\"application\" "
      "aria-label=\"The model in 3D: "
      "arrow keys turn it, plus and minus zoom, the space bar changes between before and after, Home goes back to the "
      "first view\"></canvas><div class=\"bar\"><button data-show=\"before\" aria-pressed=\"false\">Before</button>"
      "<button data-show=\"after\" aria-pressed=\"true\">After</button>";
  static constexpr std::array<std::array<std::string_view, 3>, 7> kButtons = {{{"left", "Turn left", "←"},
                                                                               {"right", "Turn right", "→"},
                                                                               {"up", "Turn up", "↑"},
                                                                               {"down", "Turn down", "↓"},
                                                                               {"near", "Zoom in", "+"},
                                                                               {"far", "Zoom out", "−"},
                                                                               {"start", "First view", "Reset"}}};
  for (const auto& [act, label, text] : kButtons)
    html += fmt::format("<button data-act=\"{}\" aria-label=\"{}\" title=\"{}\">{}</button>", act, label, label, text);
  html += fmt::format(
      "</div><p role=\"status\"></p><p>Drag with the mouse or a finger to turn the model; two fingers, or the wheel "
      "after "
      "a click, zoom. With the keyboard: arrows, plus and minus, space bar. The view has {} of the model's triangles "
      "before and {} after, so that the page stays small; the model itself is finer.</p>"
      "<script type=\"application/json\" id=\"meshes\">{{\"low\":{},\"high\":{},\"azimuth\":{},\"elevation\":{},"
      "\"texts\":{{\"before\":\"Before: as it was converted, and untouched.\",\"after\":\"After: as the hand left "
      "it.\"}},\"before\":{},\"after\":{}}}</script><script>{}</script></section>",
      before.triangles, after.triangles, numbers(box.low), numbers(box.high), r.azimuth, r.elevation, before.json,
      after.json, viewer_script());
  return html;
}

std::string pictures(const std::vector<Figure>& figures) {
  std::string html = "<h2>Pictures</h2><div class=\"pair\">";
  for (const Figure& f : figures) {
    std::ifstream stream(f.png, std::ios::binary);
    const std::string png{std::istreambuf_iterator<char>(stream), {}};
    html += fmt::format(
        "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption><b>{0}.</b> {2}</figcaption></figure>",
        escaped(f.title), base64(png), escaped(f.caption));
  }
  return html + "</div>";
}

std::string timing(const Report& r) {
  const SessionStats& s = r.stats;
  std::string html = "<h2>Time</h2><p class=\"key\">";
  html += key("var(--mark)", "touch") + key("var(--null)", "empty loop");
  html += "</p><figure><div class=\"wide\">" + histogram(s.servo.compute, &r.null_loop.compute, "CPU time of one tick");
  html += fmt::format(
      "</div><figcaption>How long one tick of touch takes: reading the device, finding the surface, the force. The "
      "further left the bars, the better; a tick has 1 ms. The height says how many ticks took so long, 1e-3 is one in "
      "a "
      "thousand.</figcaption></figure><figure><div class=\"wide\">{}</div><figcaption>How regularly the ticks came. "
      "All "
      "should be at 1 ms. The empty loop slept to the same schedule at the same time and did nothing else, so what it "
      "shows is the machine. {}</figcaption></figure>",
      histogram(s.servo.period, &r.null_loop.period, "time from tick to tick"), escaped(s.servo.note));
  return html;
}

std::string details(const Report& r) {
  const ConvertReport& c = r.conversion;
  const SessionStats& s = r.stats;
  const double fibres = static_cast<double>(std::max<std::size_t>(1, c.fibres_cast));
  std::string html = "<details><summary>All figures</summary><div class=\"wide\"><h2>Conversion</h2><table>";
  html += row("verdict of the conversion", escaped(r.conversion_verdict));
  html += row("triangles of the scan", fmt::format("{}", c.source_triangles));
  html += row("slabs", fmt::format("{}", c.slabs));
  html += row("fibres that met the scan once / never / several times",
              fmt::format("{:.2f} % / {:.2f} % / {:.2f} % of {}", 100.0 * static_cast<double>(c.hits_single) / fibres,
                          100.0 * static_cast<double>(c.hits_none) / fibres,
                          100.0 * static_cast<double>(c.hits_several) / fibres, c.fibres_cast));
  html += row("distance to the mended scan and back, share of the diagonal",
              fmt::format("rms {:.1e}, max {:.1e}; rms {:.1e}, max {:.1e}", c.to_mended.rms, c.to_mended.max,
                          c.from_mended.rms, c.from_mended.max));
  html += row("fibre length, share of the diagonal",
              fmt::format("least {:.1e}, median {:.1e}", c.thickness_min, c.thickness_median));
  html += row("CPU time, all threads", fmt::format("{:.2f} s", r.convert_seconds));
  for (const auto& phase : c.phases)
    html += row("&nbsp;&nbsp;" + escaped(phase.name), fmt::format("{:.3f} s", phase.seconds));
  html += "</table><h2>Touch</h2><table>";
  html += plots::kTimesHead;
  html += times_row("tick to tick", s.servo.period) + times_row("tick to tick, empty loop", r.null_loop.period);
  html += times_row("late", s.servo.late) + times_row("late, empty loop", r.null_loop.late);
  html += times_row("CPU per tick", s.servo.compute) +
          times_row("CPU per dab with undo and publishing", r.edits.dab_time) + "</table><table>";
  html += row("ticks / missed / not recorded",
              fmt::format("{} / {} / {}", s.servo.ticks, s.servo.overruns, s.servo.dropped));
  html += row("longest time at all that the hand can pull with", fmt::format("{:.0f} ms", 1e3 * r.stuck_for));
  html += "</table><h2>Editing and drawing, meanwhile</h2><table>";
  html += row("strokes / dabs", fmt::format("{} / {}", r.edits.strokes, r.edits.dabs));
  html += row("samples edited", fmt::format("{}", r.edits.samples));
  html += row("samples that the clay or its room did not let go further", fmt::format("{}", r.edits.limited));
  html +=
      row("frames drawn while the hand worked", fmt::format("{} of {} triangles, {:.0f} ms of CPU each (median)",
                                                            r.frames, r.frame_triangles, r.frame_cpu_seconds * 1e3));
  return html + "</table></div></details>";
}

Status write(const std::filesystem::path& file, std::string_view text) {
  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(text));
  return out.commit();
}

}  // namespace

Status write_report(const Report& r, const std::filesystem::path& file) {
  const std::string shown = pictures(r.figures);
  std::string html = fmt::format("<p class=\"sum {}\">{}</p>", class_of(worst(r.claims)), escaped(summary(r.claims)));
  html += fmt::format(
      "<p>{} was converted to {} slabs. Then a simulated hand felt, carved, smoothed, built up and painted it for "
      "{:.0f} "
      "s, with a force every millisecond, while the model was drawn. All was undone and done again, saved, read back, "
      "and "
      "the recording of the touch was repeated.</p>",
      escaped(r.model_name), r.conversion.slabs, static_cast<double>(r.stats.servo.ticks) * 1e-3);
  if (shown.size() + kRest < kMostBytes) html += view(r, kMostBytes - kRest - shown.size());
  html += verdict_table(r.claims) + shown;
  html += "<h2>Force</h2>" + force_trace(r) + timing(r) + details(r);
  return write(file, plots::page(r.title, html, kStyle));
}

Status write_verdict(const Report& r, const std::filesystem::path& file) {
  nlohmann::ordered_json claims = nlohmann::ordered_json::array();
  for (const Claim& c : r.claims) {
    claims.push_back({{"id", c.id},
                      {"claim", c.text},
                      {"verdict", class_of(c.verdict)},
                      {"value", c.value},
                      {"limit", c.limit},
                      {"unit", c.unit},
                      {"measured", c.measured}});
    if (!c.why.empty()) claims.back()["why"] = c.why;
  }
  const nlohmann::ordered_json json = {{"model", r.model_name},
                                       {"verdict", class_of(worst(r.claims))},
                                       {"summary", summary(r.claims)},
                                       {"claims", claims}};
  return write(file, json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace relief::demo
