#include "batch_page.h"

#include "plots/plot.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <utility>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;
using plots::escaped;

constexpr std::string_view kHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{0}</title>
<style>
:root{{color-scheme:light dark;--back:#faf8f5;--card:#fff;--text:#2b2723;--soft:#6d655c;--line:#e6e0d8;--bad:#b3261e;--good:#2e7d4f;--fair:#9a6a00}}
@media(prefers-color-scheme:dark){{:root{{--back:#1b1917;--card:#262320;--text:#ece7e0;--soft:#a89f94;--line:#3a3530;--bad:#ff8a7f;--good:#7fd3a2;--fair:#e8b64c}}}}
*{{box-sizing:border-box}}body{{font:15px/1.45 system-ui,sans-serif;color:var(--text);background:var(--back);max-width:1400px;margin:0 auto;padding:24px}}
h1{{font-size:26px;margin:0}}h2{{font-size:18px;margin:32px 0 10px}}p{{margin:4px 0;color:var(--soft)}}a{{color:inherit}}
header{{display:flex;flex-wrap:wrap;gap:12px 24px;align-items:center}}header input{{font:inherit;margin-left:auto;padding:6px 10px;width:16em;color:inherit;background:var(--card);border:1px solid var(--line);border-radius:6px}}
.count{{font-variant-numeric:tabular-nums}}.certified{{color:var(--good)}}.tolerant,.repaired,.preview{{color:var(--fair)}}.failed{{color:var(--bad)}}
.cards{{display:grid;grid-template-columns:repeat(auto-fill,minmax(230px,1fr));gap:16px}}
article{{background:var(--card);border:1px solid var(--line);border-radius:8px;overflow:hidden}}
article img,.none{{display:block;width:100%;height:auto;aspect-ratio:4/3;object-fit:cover;background:var(--line)}}.none{{display:grid;place-items:center;color:var(--soft)}}
article div{{padding:10px 12px 12px}}h3{{font-size:15px;margin:0 0 4px;overflow-wrap:anywhere}}article p{{font-size:13px;overflow-wrap:anywhere}}
.scroll{{overflow-x:auto}}table{{border-collapse:collapse;width:100%;background:var(--card);border:1px solid var(--line)}}
li{{overflow-wrap:anywhere}}th,td{{text-align:left;vertical-align:top;padding:7px 12px;border-top:1px solid var(--line);overflow-wrap:anywhere}}th{{font-weight:500;white-space:nowrap;color:var(--soft)}}td.end{{white-space:nowrap;font-variant-numeric:tabular-nums}}
</style></head><body>
)";

/// Shows only what has the typed words in its name, scan or verdict.
constexpr std::string_view kFilter = R"(<script>
document.querySelector("input").addEventListener("input", event => {
  const words = event.target.value.toLowerCase().split(/\s+/);
  for (const item of document.querySelectorAll("[data-scan]")) {
    const text = (item.dataset.scan + " " + item.textContent).toLowerCase();
    item.hidden = !words.every(word => text.includes(word));
  }
});
</script>
)";

/// A file beside the page, as an address. The folder in front keeps a colon in the name from being a scheme.
std::string address(std::string_view file) {
  std::string text = "./";
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || std::string_view("-_.~").contains(c))
      text += c;
    else
      text += fmt::format("%{:02X}", byte);
  }
  return text;
}

std::string mode_of(const Record& r) { return r.report.is_object() ? r.report.value("mode", "") : std::string(); }

std::string minutes(double seconds) {
  return seconds < 60 ? fmt::format("{:.1f} s", seconds) : fmt::format("{:.1f} min", seconds / 60);
}

std::string how_it_ended(const Record& r) {
  if (r.timed_out) return "time limit";
  return r.signal != 0 ? fmt::format("signal {}", r.signal) : fmt::format("exit status {}", r.exit_status);
}

std::string failure_row(const Record& r) {
  return fmt::format(
      "<tr data-scan=\"{0}\"><td><a href=\"{1}\">{2}</a></td><td>{0}</td><td>{3}</td><td class=\"end\">{4}</td>"
      "<td class=\"end\">{5}</td></tr>\n",
      escaped(r.inputs.scan), address(r.name + std::string(kRecord)), escaped(printable(r.name)), escaped(r.reason()),
      how_it_ended(r), minutes(r.seconds));
}

std::string card(const Record& r, bool is_scan_gone) {
  const std::string name = escaped(printable(r.name));
  const std::string picture =
      r.picture.empty()
          ? "<span class=\"none\">no picture</span>"
          : fmt::format(
                "<a href=\"{0}\"><img src=\"{0}\" alt=\"{1}\" loading=\"lazy\" width=\"400\" height=\"300\"></a>",
                address(r.name + ".png"), name);
  return fmt::format(
      "<article data-scan=\"{}\">{}<div><h3>{}</h3><p>{}</p>{}<p>{} slabs, {}, {:.0f} MiB. <a href=\"{}\">model</a> "
      "<a href=\"{}\">report</a></p></div></article>\n",
      escaped(r.inputs.scan), picture, name, escaped(r.report.value("verdict", "")),
      is_scan_gone ? "<p class=\"failed\">The scan is gone.</p>" : "", r.report.value("slabs", 0), minutes(r.seconds),
      r.peak_mib, address(r.name + ".relief"), address(r.name + std::string(kRecord)));
}

/// The groups of the page, weakest claim first: mode, heading.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kGroups = {
    {{"preview", "Preview: nothing is proven"},
     {"tolerant", "Tolerant: touchable; the report says where it differs from the scan"},
     {"repaired", "Certified on a repaired scan: look whether the patches matter"},
     {"certified", "Certified: proven"}}};

/// A certificate holds for what was repaired, too; how much that was is for people to judge.
std::string group_of(const Record& r) {
  const std::string mode = mode_of(r);
  if (mode != "certified") return mode;
  const auto mended = r.report.find("mended"), remesh = r.report.find("remesh");
  const bool patched = mended != r.report.end() && mended->is_object() && mended->value("replaced_triangles", 0) > 0;
  return patched || (remesh != r.report.end() && !remesh->is_null()) ? "repaired" : mode;
}

/// Whether neither this run nor a look at its place finds the scan of a record.
bool is_gone(const Record& r, const Seen& seen) {
  if (seen.scans.contains(r.inputs.scan)) return false;
  std::error_code error;
  return !std::filesystem::exists(r.inputs.scan, error) && !error;
}

std::string gone_row(const Record& r) {
  return fmt::format("<tr data-scan=\"{0}\"><td><a href=\"{1}\">{2}</a></td><td>{0}</td><td>{3}</td></tr>\n",
                     escaped(r.inputs.scan), address(r.name + std::string(kRecord)), escaped(printable(r.name)),
                     r.done ? fmt::format("<a href=\"{}\">model</a>", address(r.name + ".relief"))
                            : "no model: " + escaped(r.reason()));
}

/// A list with its heading; nothing where it is empty. Long ones are cut short.
std::string list_of(std::string_view id, std::string_view heading, const std::vector<std::string>& lines) {
  constexpr std::size_t kShown = 500;  // rows: a folder of photographs may hold many thousands
  if (lines.empty()) return {};
  std::string html = fmt::format("<h2 id=\"{0}\">{1}: {2}</h2><ul>\n", id, heading, lines.size());
  for (const std::string& line : std::span(lines).first(std::min(lines.size(), kShown)))
    html += fmt::format("<li>{}</li>\n", escaped(line));
  if (lines.size() > kShown) html += fmt::format("<li>and {} more</li>\n", lines.size() - kShown);
  return html + "</ul>\n";
}

}  // namespace

Seen Seen::of(const FoundScans& found) {
  Seen seen{.scans = {}, .others = found.others, .unreadable = found.unreadable};
  for (const Scan& scan : found.scans) seen.scans.insert(Inputs::of(scan.file, {}).scan);
  return seen;
}

std::string batch_page(std::string_view title, std::span<const Record> records, std::size_t waiting, const Seen& seen) {
  const auto count = [&](auto&& has) { return std::ranges::count_if(records, has); };
  std::set<const Record*> gone;  // in the order of the records
  for (const Record& r : records)
    if (is_gone(r, seen)) gone.insert(&r);
  const auto failed = count([&](const Record& r) { return !r.done && !gone.contains(&r); });
  std::string html = fmt::format(fmt::runtime(kHead), escaped(title));
  html += fmt::format("<header><h1>{}</h1><span class=\"count\">{} scan{}</span>", escaped(title), records.size(),
                      records.size() == 1 ? "" : "s");
  if (waiting > 0) html += fmt::format("<span class=\"count failed\">{} still to do</span>", waiting);
  if (failed > 0) html += fmt::format("<a class=\"count failed\" href=\"#failed\">{} failed</a>", failed);
  const auto link = [&](std::string_view id, std::size_t n, std::string_view what) {
    if (n > 0) html += fmt::format("<a class=\"count\" href=\"#{}\">{} {}</a>", id, n, what);
  };
  for (const auto& [mode, heading] : kGroups)
    if (const auto n = count([&](const Record& r) { return r.done && group_of(r) == mode; }); n > 0)
      html += fmt::format("<a class=\"count {0}\" href=\"#{0}\">{1} {0}</a>", mode, n);
  link("gone", gone.size(), "gone");
  link("unreadable", seen.unreadable.size(), seen.unreadable.size() == 1 ? "unreadable folder" : "unreadable folders");
  link("others", seen.others.size(), "passed over");
  html += "<input type=\"search\" placeholder=\"Find a scan\" aria-label=\"Find a scan\"></header>\n";
  if (failed > 0) {
    html += fmt::format(
        "<h2 id=\"failed\" class=\"failed\">Failed: {}</h2><div class=\"scroll\"><table><tr><th>name</th><th>scan</th>"
        "<th>why</th><th>how it ended</th><th>time</th></tr>\n",
        failed);
    for (const Record& r : records)
      if (!r.done && !gone.contains(&r)) html += failure_row(r);
    html += "</table></div>\n";
  }
  for (const auto& [mode, heading] : kGroups) {
    std::string cards;
    for (const Record& r : records)
      if (r.done && group_of(r) == mode) cards += card(r, gone.contains(&r));
    if (!cards.empty())
      html +=
          fmt::format("<h2 id=\"{0}\" class=\"{0}\">{1}</h2><div class=\"cards\">\n{2}</div>\n", mode, heading, cards);
  }
  if (!gone.empty()) {
    html += fmt::format(
        "<h2 id=\"gone\">Gone: {}</h2><p>These scans were deleted or moved after Relief worked on them. To remove a "
        "row, delete the files of that name.</p>\n<div class=\"scroll\"><table><tr><th>name</th><th>scan</th>"
        "<th>what is left</th></tr>\n",
        gone.size());
    for (const Record* r : gone) html += gone_row(*r);
    html += "</table></div>\n";
  }
  html += list_of("unreadable", "Folders that cannot be read", seen.unreadable);
  html += list_of("others", "Passed over, not meshes", seen.others);
  html += kFilter;
  return html + "</body></html>\n";
}

Status write_batch_page(const std::filesystem::path& out, std::size_t waiting, const Seen& seen) {
  // Where the file system has no locks, the pages of two runs that end together may list one scan less.
  const int folder = ::open(out.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return io_error(out.string(), "the folder cannot be read", errno);
  ::flock(folder, LOCK_EX);
  const Status written = [&]() -> Status {
    RELIEF_TRY(const std::vector<Record> records, read_records(out));
    RELIEF_TRY(AtomicFile file, AtomicFile::create(out / "index.html"));
    RELIEF_CHECK(file.write(batch_page(printable(out.filename().string()), records, waiting, seen)));
    return file.commit();
  }();
  ::close(folder);
  return written;
}

}  // namespace relief::cli
