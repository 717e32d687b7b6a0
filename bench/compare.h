// Relief against its peers: the same surface, the same ways of the cursor, in one run.
#pragma once

#include "machine.h"
#include "ways.h"

#include <relief/core/snapshot.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace relief::bench {

class Contestant;

struct Repeats {
  int frames = 3'000;        ///< of each way
  std::size_t places = 100;  ///< of each way at which answers are compared with all triangles
  int rounds = 2;            ///< in each of which every row goes each way three times; the first time only warms up
};

/// Seconds per frame of one row on one way: of each frame the least of all passes. Preemption, and what neighbours do
/// to the caches, goes; frames that are hard stay.
class LeastTimes {
 public:
  /// One round: once to warm up, then twice with the clock. Returns the mean over the better of both, seconds per
  /// frame.
  double add_round(Contestant& row, const Way& way);
  [[nodiscard]] const std::vector<double>& seconds() const noexcept { return least_; }

 private:
  std::vector<double> least_;
};

/// Relief's queries, its contact and its tick, the paper's query and the peers, on one surface and the same ways of the
/// cursor. For each row and way percentiles in ns of thread CPU time, warm; over the ways that a hand can go, together;
/// memory, build times and accuracy beside them. `ways` as from make_ways(). With an eviction also cold: everything is
/// pushed out of the caches before each frame of the slide. `build_seconds`: CPU, of the conversion that made the
/// model.
[[nodiscard]] nlohmann::ordered_json compare_on(const Surface& surface, double build_seconds, std::vector<Way> ways,
                                                const Repeats& repeats, Eviction* eviction);

/// What compare_on() found on one or more surfaces, by their names, as lines for people.
[[nodiscard]] std::string comparison_table(const nlohmann::ordered_json& on_surfaces);

/// Rows of cells under their headings, each column as wide as it must be.
[[nodiscard]] std::string aligned(const std::vector<std::vector<std::string>>& rows);

}  // namespace relief::bench
