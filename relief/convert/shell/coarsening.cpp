#include <relief/base/free_memory.h>
#include <relief/convert/shell/coarsening.h>
#include <relief/convert/shell/crease_levels.h>
#include <relief/convert/shell/fibre_goals.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {
namespace {

// A sweep over all edges.
constexpr double kSweepShare = 0.35;      // of the edges, the cheapest ones, may be tried
constexpr std::size_t kCostStride = 7;    // of so many edges one is weighed to find what that share costs
constexpr std::size_t kWorthASweep = 50;  // one slab in so many must go, or the sweep was the last

// Rounds of collapses by cost, with moves in between.
constexpr int kMostRounds = 40;
constexpr std::size_t kInVain = 50;  // a round that removes less than one in so many is the last; where nothing else is
                                     // left to try the second in a row that removes none
constexpr std::size_t kDear = 10;    // the same where most edges resist, as each round tries them again, and where the
                                     // lists are long
constexpr int kFirstRounds = 3;      // of which none is the last because it was in vain
constexpr std::size_t kMany = 20000;         // slabs from which a round that still removes
constexpr std::size_t kStillQuick = 10;      // one in so many is followed by the next without moves
constexpr std::size_t kPatientFrom = 16;     // times the target: from there each slab is worth more tries
constexpr std::size_t kPatientBelow = 3200;  // slabs, the same
constexpr std::size_t kLastChance = 16;      // times the target: below it, where all is allowed, rounds go on longer

/// Of a fibre's length: by so much fibres are lengthened, twice over.
constexpr std::array<double, 2> kLengthen = {0.5, 0.15};

}  // namespace

Coarsening::Coarsening(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft,
                       const Box3d& room, const Progress& progress)
    : patch_(source, tree, longest, std::move(draft), room, progress),
      tried_(patch_.draft().twins.size(), 0),
      improved_(patch_.draft().out.size(), 0),
      stamps_(patch_.draft().out.size(), 0) {}

EdgeOperators Coarsening::edges() noexcept {
  return patch_.edges(growth_, {.patient = slab_count() <= few_, .thorough = thorough_});
}

/// Returns the cost that so large a share of the edges does not exceed, by a choice of them; below 0: there are none.
double Coarsening::cost_above(double share) const {
  std::vector<double> costs;
  std::size_t counter = 0;
  for (std::uint32_t h = 0; h < draft().twins.size(); ++h)
    if (draft().is_free_edge(h) && ++counter % kCostStride == 0)
      costs.push_back(collapse_cost(draft(), draft().origin(h), draft().target(h)).cost);
  if (costs.empty()) return -1;
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(share * double(costs.size()));
  std::nth_element(costs.begin(), middle, costs.end());
  return *middle;
}

// While there are many slabs, edges below a rising cost collapse in memory order: cost order matters little then, and
// the cache stays warm. A fibre that has taken up another rests until the next sweep, unless the edge came up from the
// other's side.
bool Coarsening::sweep(std::size_t stop, const Progress& progress) {
  swept_to_ = stop;
  std::vector<std::uint32_t> swept(draft().out.size(), 0);  // per fibre: the sweep in which it last took up another
  const double start = double(slab_count());
  const std::size_t fixed = slab_count() - free_count();
  for (std::uint32_t round = 1; slab_count() > stop; ++round) {
    if (progress.cancelled()) return false;
    const double most = cost_above(kSweepShare);
    if (most < 0) break;
    const std::size_t before = slab_count();
    for (std::uint32_t h = 0; h < draft().twins.size() && slab_count() > stop; ++h) {
      if (!draft().is_free_edge(h)) continue;
      const std::uint32_t u = draft().origin(h), v = draft().target(h);
      if (swept[u] == round || swept[v] == round || !is_untried(h)) continue;
      if (collapse_cost(draft(), u, v).cost > most) continue;
      EdgeOperators operators = edges();
      if (operators.half_edge_collapse(h, most) || operators.collapse(h)) {
        swept[u] = round;
        if ((slab_count() & 1023U) == 0) {
          if (progress.cancelled()) return false;
          progress("reduce",
                   kCellsSwept + (kAllSwept - kCellsSwept) * (start - double(slab_count())) / (start - double(stop)));
        }
      } else {
        note_tried(h, draft().clock);
      }
    }
    if (progress.cancelled()) return false;
    if (kWorthASweep * (before - slab_count()) < before - fixed) break;
  }
  return true;
}

void Coarsening::tolerate(const Tolerance& tolerance) {
  thorough_ = true;
  tried_.assign(tried_.size(), 0);
  patch_.tolerate(tolerance);
}

double Coarsening::lost() const {
  enum class Place : std::uint8_t { Outside, Inside, Across };
  const SourceIndex& source = patch_.source();
  std::vector<Place> places(source.faces.size(), Place::Outside);
  for (std::uint32_t f = 0; f < draft().faces.size(); ++f) {
    if (!draft().alive(f)) continue;
    const SlabShape shape(draft().triangle(f, kInner), draft().triangle(f, kOuter));
    for_triangles(source, draft().lists.of(f), [&](std::uint32_t t) {
      const Meeting m = shape.meet(source.triangle(t));
      if (m == Meeting::Outer || m == Meeting::Inner) places[t] = Place::Across;
      if (m != Meeting::Apart && places[t] == Place::Outside) places[t] = Place::Inside;
    });
  }
  double all = 0, outside = 0;
  for (std::uint32_t t = 0; t < source.faces.size(); ++t) {
    const double area = length(source.cross_of(t));
    all += area;
    if (places[t] != Place::Inside) outside += places[t] == Place::Across ? 0.5 * area : area;
  }
  return all > 0 ? outside / all : 0;
}

Coarsening::Candidate Coarsening::candidate(std::uint32_t h) const noexcept {
  const auto [u, v] = std::minmax({draft().origin(h), draft().target(h)});
  return {collapse_cost(draft(), u, v).cost, u, v, stamps_[u], stamps_[v]};
}

void Coarsening::fill_queue() {
  const auto for_untried = [&](auto&& visit) {
    for (std::uint32_t h = 0; h < draft().twins.size(); ++h)
      if (draft().is_free_edge(h) && is_untried(h)) visit(h);
  };
  std::size_t untried = 0;
  for_untried([&](std::uint32_t) { ++untried; });
  queue_.clear();
  queue_.reserve(untried + untried / 8);
  for_untried([&](std::uint32_t h) { queue_.push_back(candidate(h)); });
  std::make_heap(queue_.begin(), queue_.end());
}

/// Collapses the edge of a candidate if it is still as it was, and puts those around the merged fibre into the queue.
bool Coarsening::collapse_candidate(const Candidate& c) {
  if (stamps_[c.u] != c.stamp_u || stamps_[c.v] != c.stamp_v) return false;
  std::uint32_t h = kNone;
  draft().for_ring(c.u, [&](std::uint32_t e) {
    if (draft().target(e) == c.v) h = e;
  });
  if (h == kNone || !is_untried(h)) return false;
  if (!edges().collapse(h)) {
    note_tried(h, draft().clock);
    return false;
  }
  ++stamps_[c.u];
  ++stamps_[c.v];
  draft().for_ring(c.u, [&](std::uint32_t e) {
    queue_.push_back(candidate(e));
    std::push_heap(queue_.begin(), queue_.end());
  });
  return true;
}

/// Collapses by cost until the queue is empty or so few slabs are left. False when cancelled.
bool Coarsening::empty_queue(std::size_t target_count, const std::function<void()>& report, const Progress& progress) {
  std::size_t counter = 0;
  while (!queue_.empty() && slab_count() > target_count) {
    if ((++counter & 255U) == 0) {
      if (progress.cancelled()) return false;
      if ((counter & 8191U) == 0) report();
    }
    std::pop_heap(queue_.begin(), queue_.end());
    const Candidate next = queue_.back();
    queue_.pop_back();
    collapse_candidate(next);
  }
  return true;
}

bool Coarsening::improve_all(const Progress& progress) {
  FibreMoves moves = patch_.moves();
  for (std::uint32_t v = 0; v < draft().out.size(); ++v) {
    if (draft().out[v] == kNone || draft().changed[v] <= improved_[v]) continue;
    moves.improve(v);
    if (thorough_) moves.settle(v);
    if (patch_.tolerance().folds_at_will()) moves.even_out(v);
    improved_[v] = draft().clock;
    if ((v & 63U) == 0 && progress.cancelled()) return false;
  }
  return true;
}

bool Coarsening::lengthen_all(const Progress& progress) {
  FibreMoves moves = patch_.moves();
  for (const double share : kLengthen)
    for (std::uint32_t v = 0; v < draft().out.size(); ++v) {
      if (draft().out[v] != kNone) moves.lengthen(v, share);
      if ((v & 63U) == 0 && progress.cancelled()) return false;
    }
  return true;
}

void Coarsening::flip_all() {
  for (std::uint32_t h = 0; h < draft().twins.size(); ++h) {
    if (!draft().alive(h / 3) || h >= draft().twins[h]) continue;
    const std::array<std::uint32_t, 2> faces = {h / 3, draft().twins[h] / 3};
    if (!edges().flip(h)) continue;
    for (const std::uint32_t f : faces)
      for (std::uint32_t e = 3 * f; e < 3 * f + 3; ++e) note_tried(e, 0);
  }
}

bool Coarsening::reduce(std::size_t target_count, const Progress& progress) {
  // Where the sweep has stopped far above its goal most edges resist: patience takes more of them in less time.
  const bool stuck = slab_count() > swept_to_ + swept_to_ / 2;
  const bool is_dear = stuck || patch_.source().faces.size() > kLarge;
  few_ = stuck ? slab_count() : std::max(kPatientFrom * target_count, kPatientBelow) - 1;
  // No component can have fewer than four slabs.
  std::uint32_t components = 0;
  for (std::uint32_t f = 0; f < draft().faces.size(); ++f)
    if (draft().alive(f)) components = std::max(components, draft().component_of(f) + 1);
  const std::size_t floor = std::max<std::size_t>(target_count, 4 * std::size_t{components});
  const double start = double(slab_count());
  const auto report = [&] {
    progress("reduce", kAllSwept + (1 - kAllSwept) * std::log(start / double(slab_count())) /
                                       std::log(start / double(target_count)));
  };
  int vain = 0;  // the last rounds that removed hardly any
  for (int round = 0; slab_count() > target_count && round < kMostRounds; ++round) {
    if (progress.cancelled()) return false;
    const std::size_t before = slab_count();
    fill_queue();
    if (!empty_queue(target_count, report, progress)) return false;
    const std::size_t removed = before - slab_count();
    if (slab_count() <= floor) break;
    if (is_dear && round >= 1 && removed < before / kDear) break;
    if (!stuck && slab_count() >= kMany && kStillQuick * removed >= before) continue;
    if (!improve_all(progress)) return false;
    flip_all();
    if (!improve_all(progress)) return false;
    // Long fibres leave more room for collapses where they grow away from the source, short ones where they grow
    // towards others: by turns.
    if (thorough_ && round % 2 == 0 && !lengthen_all(progress)) return false;
    const bool is_last_chance = patch_.tolerance().folds_at_will() && before < kLastChance * target_count;
    const std::size_t few = is_last_chance ? 2 : std::max<std::size_t>(2, before / kInVain);
    vain = removed < few ? vain + 1 : 0;
    if (slab_count() <= floor || (round >= kFirstRounds && vain >= (is_last_chance ? 2 : 1))) break;
  }
  return true;
}

bool Coarsening::thicken(double longest, const Creases& creases, const Progress& progress) {
  free_memory(queue_, tried_, stamps_);
  patch_.free_quadrics();
  patch_.allow(longest);
  if (!lengthen_to_goals(patch_, progress)) return false;
  if (creases.empty()) return true;
  level_creases(patch_, creases, tree_of(patch_.source()), progress);
  return !progress.cancelled();
}

}  // namespace relief::detail
