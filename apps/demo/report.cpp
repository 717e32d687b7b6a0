#include "report.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string_view>

namespace relief::demo {

namespace {

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

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

/// A drawing area with axes; x and y are data, mapped linearly.
class Plot {
 public:
  Plot(double x0, double x1, double y0, double y1) : x0_(x0), x1_(x1), y0_(y0), y1_(y1) {
    body_ = fmt::format(R"(<svg viewBox="0 0 {} {}" role="img">)", kWidth, kHeight);
  }
  [[nodiscard]] double x(double v) const { return kLeft + (v - x0_) / (x1_ - x0_) * (kWidth - kLeft - kRight); }
  [[nodiscard]] double y(double v) const {
    return kHeight - kBottom - (v - y0_) / (y1_ - y0_) * (kHeight - kTop - kBottom);
  }
  void tick_x(double v, std::string_view label) {
    body_ += fmt::format(
        R"(<line class="grid" x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/><text class="mid" x="{0:.1f}" y="{3}">{4}</text>)",
        x(v), kTop, kHeight - kBottom, kHeight - kBottom + 16, label);
  }
  void tick_y(double v, std::string_view label) {
    body_ += fmt::format(
        R"(<line class="grid" x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}"/><text class="end" x="{3}" y="{4:.1f}">{5}</text>)",
        y(v), kLeft, kWidth - kRight, kLeft - 6, y(v) + 4, label);
  }
  void add(std::string_view shape) { body_ += shape; }
  std::string finish(std::string_view x_title, std::string_view y_title) {
    body_ += fmt::format(
        R"svg(<text class="mid" x="{}" y="{}">{}</text><text class="mid" transform="translate(14 {}) rotate(-90)">{}</text></svg>)svg",
        (kLeft + kWidth - kRight) / 2, kHeight - 6, x_title, (kTop + kHeight - kBottom) / 2, y_title);
    return body_;
  }

 private:
  static constexpr double kWidth = 900, kHeight = 260, kLeft = 62, kRight = 12, kTop = 12, kBottom = 44;
  double x0_, x1_, y0_, y1_;
  std::string body_;
};

/// A step of 1, 2 or 5 times a power of ten that cuts the span into about `count` parts.
double nice_step(double span, int count) {
  const double raw = span / count, power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0})
    if (m * power >= raw) return m * power;
  return 10 * power;
}

std::string force_trace(const std::vector<ServoSample>& trace) {
  if (trace.size() < 2) return "<p>No sample reached the trace.</p>";
  const double t0 = trace.front().t, t1 = std::max(trace.back().t, t0 + 1e-3);
  double top = 0.1;
  for (const ServoSample& s : trace) top = std::max(top, length(s.force));
  Plot plot(0, t1 - t0, 0, top * 1.05);
  for (double t = 0, step = nice_step(t1 - t0, 10); t <= t1 - t0; t += step) plot.tick_x(t, fmt::format("{:g}", t));
  for (double f = 0, step = nice_step(top, 5); f <= top * 1.05; f += step) plot.tick_y(f, fmt::format("{:.3g}", f));
  // Least and greatest force per column, so that no spike is lost; the strip below shows what the button did.
  constexpr std::size_t kColumns = 800;
  std::string area_top, area_bottom, strip;
  const std::size_t per = std::max<std::size_t>(1, trace.size() / kColumns);
  static constexpr std::array<std::string_view, 6> kStrip = {"#c9c4bb", "#b5532d", "#3f7d58",
                                                             "#5b3a29", "#c79a3b", "#b03a2e"};
  for (std::size_t k = 0; k < trace.size(); k += per) {
    double low = 1e300, high = 0;
    const std::size_t end = std::min(trace.size(), k + per);
    for (std::size_t i = k; i < end; ++i) {
      low = std::min(low, length(trace[i].force));
      high = std::max(high, length(trace[i].force));
    }
    const double x = plot.x(trace[k].t - t0);
    area_top += fmt::format("{:.1f},{:.1f} ", x, plot.y(high));
    area_bottom = fmt::format("{:.1f},{:.1f} ", x, plot.y(low)) + area_bottom;
    const bool pressed = (trace[k].buttons & 1U) != 0;
    if (pressed || trace[k].contact) {
      const std::size_t colour = pressed ? 1 + std::min<std::size_t>(trace[k].buttons >> 8U, 4) : 0;
      strip += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="1.3" height="5" fill="{}"/>)", x, plot.y(0) + 1,
                           kStrip[colour]);
    }
  }
  plot.add(fmt::format(R"(<polygon class="force" points="{}{}"/>)", area_top, area_bottom));
  plot.add(strip);
  return plot.finish("time, s (strip: touching, carving, building, painting)", "force on the hand, N");
}

/// Two histograms over the same logarithmic axis, as shares of all ticks.
std::string histogram(const TimeHistogram& ours, const TimeHistogram* null, std::string_view title) {
  int first = TimeHistogram::kBins, last = 0;
  double top = 0;
  for (const TimeHistogram* h : {&ours, null}) {
    if (h == nullptr || h->count() == 0) continue;
    for (int b = 0; b < TimeHistogram::kBins; ++b) {
      if (h->bin_count(b) == 0) continue;
      first = std::min(first, b);
      last = std::max(last, b);
      top = std::max(top, static_cast<double>(h->bin_count(b)) / static_cast<double>(h->count()));
    }
  }
  if (top == 0) return "<p>Nothing was timed.</p>";
  Plot plot(first, last + 1, std::log10(1e-6), 0);
  for (int e = -6; e <= 0; ++e) plot.tick_y(e, e == 0 ? "1" : fmt::format("1e{}", e));
  const std::array<std::pair<double, std::string_view>, 8> marks = {{{1e2, "0.1 µs"},
                                                                     {1e3, "1 µs"},
                                                                     {1e4, "10 µs"},
                                                                     {1e5, "0.1 ms"},
                                                                     {1e6, "1 ms"},
                                                                     {1e7, "10 ms"},
                                                                     {1e8, "0.1 s"},
                                                                     {1e9, "1 s"}}};
  for (const auto& [ns, label] : marks)
    for (int b = first; b <= last; ++b)
      if (TimeHistogram::bin_low(b) <= ns && ns < TimeHistogram::bin_low(b + 1)) plot.tick_x(b, label);
  const auto bars = [&](const TimeHistogram& h, double shift, std::string_view style) {
    std::string out;
    for (int b = first; b <= last; ++b) {
      if (h.bin_count(b) == 0) continue;
      const double share = static_cast<double>(h.bin_count(b)) / static_cast<double>(h.count());
      const double y = plot.y(std::log10(std::max(share, 1e-6)));
      out += fmt::format(R"(<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>)", style,
                         plot.x(b + shift), y, (plot.x(1) - plot.x(0)) * 0.45, plot.y(-6) - y);
    }
    return out;
  };
  if (null != nullptr) plot.add(bars(*null, 0.5, "null"));
  plot.add(bars(ours, 0, "ours"));
  return plot.finish(title, "share of ticks");
}

std::string row(std::string_view what, std::string_view value) {
  return fmt::format("<tr><th>{}</th><td>{}</td></tr>", what, value);
}

std::string times_row(std::string_view what, const TimeHistogram& h) {
  return fmt::format("<tr><th>{}</th><td>{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}</td></tr>",
                     what, h.count(), static_cast<double>(h.quantile(0.5)) * 1e-3,
                     static_cast<double>(h.quantile(0.99)) * 1e-3, static_cast<double>(h.quantile(0.999)) * 1e-3,
                     static_cast<double>(h.max()) * 1e-3);
}

constexpr std::string_view kStyle = R"(
:root{color-scheme:light}body{font:15px/1.5 system-ui,sans-serif;color:#2b2723;background:#faf8f5;max-width:960px;margin:0 auto;padding:24px}
h1{font-size:28px;margin:0 0 4px}h2{font-size:19px;margin:32px 0 8px}p{margin:6px 0 12px;max-width:70ch}
img{width:100%;border-radius:6px;display:block}figure{margin:0}figcaption{font-size:13px;color:#6d655c;margin:4px 0 14px}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:16px}table{border-collapse:collapse;margin:6px 0}
th{font-weight:500;text-align:left;padding:3px 18px 3px 0;color:#6d655c}td{padding:3px 18px 3px 0;font-variant-numeric:tabular-nums}
tr.head th{font-size:13px}svg{width:100%;background:#fff;border:1px solid #e6e0d8;border-radius:6px}
svg text{font:12px system-ui,sans-serif;fill:#6d655c}.mid{text-anchor:middle}.end{text-anchor:end}
.grid{stroke:#eee9e2}.force{fill:#c96f2e;stroke:#c96f2e;stroke-width:.8}.ours{fill:#c96f2e}.null{fill:#8fa3b0}
.key span{display:inline-block;width:11px;height:11px;border-radius:2px;margin:0 5px 0 14px}
@media(max-width:640px){.pair{grid-template-columns:1fr}}
)";

}  // namespace

Status write_report(const Report& r, const std::filesystem::path& file) {
  const ConvertReport& c = r.conversion;
  const SessionStats& s = *r.stats;
  std::string html = fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title><style>{1}</style></head><body><h1>{0}</h1><p>{2}: converted, "
      "felt, "
      "carved and painted by a simulated hand while it was drawn; saved, and read back {3}.</p>",
      escaped(r.title), kStyle, escaped(r.model_name),
      r.reload_identical ? "bit for bit the same" : "<b>with differences</b>");

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

  html += "<h2>Force</h2>" + force_trace(s.trace);
  html += fmt::format("<p>Largest force {:.2f} N; {} of {} ticks in contact.</p>", r.force_max, s.contact_samples,
                      s.samples);

  html +=
      "<h2>Servo, 1 kHz</h2><p class=\"key\">The null loop sleeps to the same schedule at the same time and does "
      "nothing "
      "else: what it shows is the machine.<span style=\"background:#c96f2e\"></span>servo<span "
      "style=\"background:#8fa3b0\"></span>null loop</p>";
  html += histogram(s.servo.period, &r.null_loop.period, "period from wake-up to wake-up");
  html += histogram(s.servo.compute, &r.null_loop.compute, "CPU time of one tick (device, query, force law)");
  html +=
      "<table><tr class=\"head\"><th>µs</th><th>count</th><th>median</th><th>p99</th><th>p99.9</th><th>max</th></tr>";
  html += times_row("period", s.servo.period) + times_row("period, null loop", r.null_loop.period);
  html += times_row("late", s.servo.late) + times_row("late, null loop", r.null_loop.late);
  html += times_row("CPU per tick", s.servo.compute) + times_row("CPU per dab with undo and publishing", s.dab_time) +
          "</table>";
  html += fmt::format(
      "<p>{} ticks, {} periods skipped, {} samples dropped. {}</p>", s.servo.ticks, s.servo.overruns, s.servo.dropped,
      s.servo.note.empty() ? std::string("Real-time priority and locked memory were granted.") : escaped(s.servo.note));

  html += "<h2>Editing and drawing, meanwhile</h2><table>";
  html += row("strokes / dabs", fmt::format("{} / {}", s.strokes, s.dabs));
  html += row("samples edited", fmt::format("{}", s.samples_edited));
  html += row("frames drawn while the servo ran", fmt::format("{} of {} triangles, {:.0f} ms of CPU each (median)",
                                                              r.frames, r.frame_triangles, r.frame_cpu_seconds * 1e3));
  html += "</table></body></html>\n";

  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(html));
  return out.commit();
}

}  // namespace relief::demo
