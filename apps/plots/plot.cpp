#include "plots/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace relief::plots {

namespace {

/// A drawing area with axes; x and y are data, mapped linearly.
class Plot {
 public:
  Plot(double x0, double x1, double y0, double y1) : x0_(x0), x1_(x1), y0_(y0), y1_(y1) {}
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
  [[nodiscard]] std::string finish(std::string_view x_title, std::string_view y_title) const {
    return fmt::format(
        R"svg(<svg viewBox="0 0 {} {}" role="img"><title>{} over {}</title>{}<text class="mid" x="{}" y="{}">{}</text><text class="mid" transform="translate(14 {}) rotate(-90)">{}</text></svg>)svg",
        kWidth, kHeight, y_title, x_title, body_, (kLeft + kWidth - kRight) / 2, kHeight - 6, x_title,
        (kTop + kHeight - kBottom) / 2, y_title);
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

}  // namespace

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

Envelope::Envelope(double end) : end_(end > 0 ? end : 1) {
  low_.fill(1e300);
  high_.fill(-1e300);
}

void Envelope::add(double x, double value) noexcept {
  if (!std::isfinite(value) || !(x >= 0 && x <= end_)) return;
  const std::size_t k = std::min(kColumns - 1, static_cast<std::size_t>(x / end_ * kColumns));
  low_[k] = std::min(low_[k], value);
  high_[k] = std::max(high_[k], value);
}

std::string trace(const Envelope& values, std::string_view x_title, std::string_view y_title,
                  const std::function<std::string_view(std::size_t)>& colour) {
  double bottom = 0, top = 0;
  for (std::size_t k = 0; k < Envelope::kColumns; ++k) {
    if (values.empty(k)) continue;
    bottom = std::min(bottom, values.low(k));
    top = std::max(top, values.high(k));
  }
  if (bottom == top) top = 1;
  const double margin = 0.05 * (top - bottom), end = values.end();
  Plot plot(0, end, bottom < 0 ? bottom - margin : 0, top + margin);
  for (double x = 0, step = nice_step(end, 10); x <= end; x += step) plot.tick_x(x, fmt::format("{:g}", x));
  const double step = nice_step(top - bottom, 5);
  for (double y = std::ceil(bottom / step) * step; y <= top + margin; y += step)
    plot.tick_y(y, fmt::format("{:.3g}", std::abs(y) < step / 2 ? 0 : y));
  std::string area_top, area_bottom, strip;
  for (std::size_t k = 0; k < Envelope::kColumns; ++k) {
    if (values.empty(k)) continue;
    const double x = plot.x(end * (static_cast<double>(k) + 0.5) / Envelope::kColumns);
    area_top += fmt::format("{:.1f},{:.1f} ", x, plot.y(values.high(k)));
    area_bottom.insert(0, fmt::format("{:.1f},{:.1f} ", x, plot.y(values.low(k))));
    if (const std::string_view fill = colour ? colour(k) : ""; !fill.empty())
      strip += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="1.3" height="5" fill="{}"/>)", x - 0.6, plot.y(0) + 1,
                           fill);
  }
  plot.add(fmt::format(R"(<polygon class="trace" points="{}{}"/>)", area_top, area_bottom));
  plot.add(strip);
  return plot.finish(x_title, y_title);
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

std::string page(std::string_view title, std::string_view body, std::string_view style) {
  // Colours have names, so that the dark scheme is one line.
  static constexpr std::string_view kStyle = R"(
:root{color-scheme:light dark;--ink:#2b2723;--soft:#655d55;--page:#faf8f5;--card:#fff;--line:#e3dcd3;--grid:#eee9e2;--mark:#c25f1d;--null:#7e94a3;--good:#1f7a45;--odd:#8a5a00;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--ink:#ece7e1;--soft:#b3aaa0;--page:#191715;--card:#22201d;--line:#3a3632;--grid:#2e2b28;--mark:#e58a4b;--null:#8fa3b0;--good:#6fcf97;--odd:#f2c14e;--bad:#ff8a80}}
*{box-sizing:border-box}body{font:16px/1.55 system-ui,sans-serif;color:var(--ink);background:var(--page);max-width:1000px;margin:0 auto;padding:24px 20px 48px}
h1{font-size:28px;line-height:1.2;margin:0 0 8px}h2{font-size:20px;margin:36px 0 8px}p{margin:6px 0 12px;max-width:70ch}
img{width:100%;height:auto;border-radius:6px;display:block}figure{margin:0}figcaption{font-size:14px;color:var(--soft);margin:6px 0 16px;max-width:70ch}
.pair{display:grid;grid-template-columns:1fr 1fr;gap:16px}.wide{overflow-x:auto}table{border-collapse:collapse;margin:6px 0}
th{font-weight:500;text-align:left;vertical-align:top;padding:4px 18px 4px 0;color:var(--soft)}td{vertical-align:top;padding:4px 18px 4px 0;font-variant-numeric:tabular-nums}
tr.head th{font-size:14px}svg{width:100%;min-width:520px;display:block;background:var(--card);border:1px solid var(--line);border-radius:6px}
svg text{font:12px system-ui,sans-serif;fill:var(--soft)}.mid{text-anchor:middle}.end{text-anchor:end}
.grid{stroke:var(--grid)}.trace{fill:var(--mark);stroke:var(--mark);stroke-width:.8}.ours{fill:var(--mark)}.null{fill:var(--null)}
.key span{display:inline-block;width:11px;height:11px;border-radius:2px;margin:0 5px 0 14px}.key span:first-child{margin-left:0}
summary{cursor:pointer;color:var(--soft);margin:24px 0 8px}:focus-visible{outline:3px solid var(--mark);outline-offset:2px}
@media(max-width:640px){.pair{grid-template-columns:1fr}body{padding:16px 14px 40px}}
)";
  return fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>{0}</title><style>{1}{3}</style></"
      "head><body><main><h1>{0}</h1>{2}</main></body></html>\n",
      escaped(title), kStyle, body, style);
}

}  // namespace relief::plots
