#include "compare.h"

#include "ours.h"
#include "peers.h"
#include "timing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

constexpr std::size_t kColdFrames = 100;

/// Keeps the optimiser honest.
volatile double answers_sum = 0;

/// The frames of a way that a row goes.
std::size_t frames_of(const Contestant& row, const Way& way) { return std::min(row.most_frames, way.cursors.size()); }

/// Against the nearest points of all triangles.
ordered_json accuracy(Contestant& row, const Way& way, double scale) {
  std::vector<double> errors, angles;
  int wrong_side = 0, none = 0;
  auto truth = way.truths.begin();
  for (std::size_t k = 0; k < frames_of(row, way); ++k) {
    const Vec3d p = way.cursors[k];
    if (way.begins_at(k)) row.approach(p, way.ups[k / way.section]);
    const std::optional<Nearest> found = row.answer(p, way.coherent);
    if (truth == way.truths.end() || truth->frame != k) continue;
    const Nearest& right = (truth++)->nearest;
    if (!found) {
      ++none;
      continue;
    }
    errors.push_back(std::abs(found->distance_from(p) - right.distance_from(p)) / scale);
    const double cosine = std::clamp(dot(found->normal, right.normal), -1.0, 1.0);
    angles.push_back(std::acos(cosine) * 180 / std::numbers::pi);
    if (right.distance_from(p) > 1e-6 * scale && found->inside != right.inside) ++wrong_side;
  }
  return {{"places", errors.size() + static_cast<std::size_t>(none)},
          {"distance_error_of_diagonal", percentiles(errors, 1)},
          {"normal_degrees", percentiles(angles, 1)},
          {"wrong_side", wrong_side},
          {"without_answer", none}};
}

/// Each of some frames of the slide with nothing in the caches, seconds.
std::vector<double> cold_times(Contestant& row, const Way& way, Eviction& eviction) {
  const CallTimer timer;
  std::vector<double> cold;
  row.approach(way.cursors.front(), way.ups.front());
  for (std::size_t k = 0; k < std::min(kColdFrames, frames_of(row, way)); ++k) {
    eviction();
    cold.push_back(timer([&] { answers_sum = answers_sum + row.ask(way.cursors[k], way.coherent); }));
  }
  return cold;
}

}  // namespace

double LeastTimes::add_round(Contestant& row, const Way& way) {
  const CallTimer timer;
  const std::size_t frames = frames_of(row, way);
  least_.resize(frames, std::numeric_limits<double>::infinity());
  double best = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 3; ++pass) {
    double all = 0;
    for (std::size_t k = 0; k < frames; ++k) {
      if (way.begins_at(k)) row.approach(way.cursors[k], way.ups[k / way.section]);
      double answer = 0;
      const double took = timer([&] { answer = row.ask(way.cursors[k], way.coherent); });
      answers_sum = answers_sum + answer;
      all += took;
      if (pass > 0) least_[k] = std::min(least_[k], took);
    }
    if (pass > 0) best = std::min(best, all / static_cast<double>(std::max<std::size_t>(1, frames)));
  }
  return best;
}

ordered_json compare_on(const Surface& surface, double build_seconds, std::vector<Way> ways, const Repeats& repeats,
                        Eviction* eviction) {
  const Tessellation drawn = tessellate(surface.model);
  const auto triangles = static_cast<double>(drawn.triangles.size());
  find_truths(drawn, repeats.places, ways);

  std::vector<std::unique_ptr<Contestant>> rows = make_ours(surface, build_seconds);
  for (auto& peer : make_peers(drawn)) rows.push_back(std::move(peer));
  ordered_json json = {{"triangles", drawn.triangles.size()}, {"frames", ways.front().cursors.size()}};
  for (const auto& row : rows) {
    ordered_json& of = json["rows"][row->name];
    of = {{"bytes_per_triangle", static_cast<double>(row->bytes) / triangles},
          {"build_cpu_seconds", row->build_seconds}};
    for (const Way& way : ways)
      if (row->has_nearest) of["accuracy"][way.name] = accuracy(*row, way, surface.size);
  }
  std::vector<std::vector<LeastTimes>> times(rows.size(), std::vector<LeastTimes>(ways.size()));
  std::vector<std::vector<double>> means(rows.size(), std::vector<double>(ways.size(), 1e9));
  for (int round = 0; round < repeats.rounds; ++round)
    for (std::size_t w = 0; w < ways.size(); ++w)
      for (std::size_t r = 0; r < rows.size(); ++r)
        means[r][w] = std::min(means[r][w], times[r][w].add_round(*rows[r], ways[w]));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    ordered_json& ns = json["rows"][rows[r]->name]["warm_ns"];
    std::vector<double> by_hand;
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const std::vector<double>& seconds = times[r][w].seconds();
      ns[ways[w].name] = percentiles(seconds, 1e9);
      ns[ways[w].name]["mean"] = means[r][w] * 1e9;
      if (w < kHandWays) by_hand.insert(by_hand.end(), seconds.begin(), seconds.end());
    }
    ns["hand"] = percentiles(by_hand, 1e9);
  }
  if (eviction != nullptr)
    for (const auto& row : rows)
      if (row->cold) json["rows"][row->name]["cold_ns"] = percentiles(cold_times(*row, ways.front(), *eviction), 1e9);
  return json;
}

namespace {

constexpr std::array kWays = {"slide", "tap", "press", "jump"};

/// Percentiles of a row, us.
std::string four(const ordered_json& ns) {
  std::string text;
  for (const char* which : {"p50", "p99", "p999", "max"}) {
    const double us = ns[which].get<double>() / 1000;
    text += fmt::format("{}{:.{}f}", text.empty() ? "" : "/", us, us < 10 ? 2 : 0);
  }
  return text;
}

std::string accuracy_cell(const ordered_json& at) {
  const ordered_json &distance = at["distance_error_of_diagonal"], &normal = at["normal_degrees"];
  return fmt::format("{:.0e}/{:.0e} {:.1f}/{:.1f} {} {}", distance["p50"].get<double>(), distance["p99"].get<double>(),
                     normal["p50"].get<double>(), normal["p99"].get<double>(), at["wrong_side"].get<int>(),
                     at["without_answer"].get<int>());
}

}  // namespace

std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) line += fmt::format("{:<{}}  ", row[k], widths[k]);
    text += "  " + line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string comparison_table(const ordered_json& on_surfaces) {
  using Table = std::vector<std::vector<std::string>>;
  std::string text;
  for (const auto& [name, all] : on_surfaces.items()) {
    if (all.contains("skipped")) {
      text += fmt::format("\n{}: skipped: {}\n", name, all["skipped"].get<std::string>());
      continue;
    }
    Table times = {{""}}, right = {{""}};
    for (Table* table : {&times, &right}) table->front().insert(table->front().end(), kWays.begin(), kWays.end());
    const bool cold = all["rows"].front().contains("cold_ns");
    if (cold) times.front().emplace_back("slide, cold");
    times.front().insert(times.front().end(), {"bytes/triangle", "build, CPU s"});
    for (const auto& [row, of] : all["rows"].items()) {
      times.push_back({row});
      for (const char* way : kWays) times.back().push_back(four(of["warm_ns"][way]));
      if (cold) times.back().push_back(of.contains("cold_ns") ? four(of["cold_ns"]) : "");
      times.back().push_back(fmt::format("{:.1f}", of["bytes_per_triangle"].get<double>()));
      times.back().push_back(fmt::format("{:.1f}", of["build_cpu_seconds"].get<double>()));
      if (!of.contains("accuracy")) continue;
      right.push_back({row});
      for (const char* way : kWays) right.back().push_back(accuracy_cell(of["accuracy"][way]));
    }
    text += fmt::format("\n{}, {} triangles. us of thread CPU time, p50/p99/p99.9/max; build: once, for all ways\n",
                        name, all["triangles"].get<std::size_t>()) +
            aligned(times);
    text += fmt::format(
        "\n  The same against all triangles, one after the other, at some {} places of each way: distance off, shares "
        "of\n"
        "  the diagonal, p50/p99; normal off, degrees, p50/p99; on the wrong side; without an answer\n",
        all["rows"].front()["accuracy"]["slide"]["places"].get<std::size_t>());
    text += aligned(right);
  }
  return text;
}

}  // namespace relief::bench
