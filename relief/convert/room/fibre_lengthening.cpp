#include <relief/convert/geometry/components.h>
#include <relief/convert/room/fibre_lengthening.h>
#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/solids.h>
#include <relief/convert/shell/fibre_direction.h>
#include <relief/convert/shell/patch.h>
#include <relief/convert/support/sort_unique.h>
#include <relief/core/query.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace relief::detail {
namespace {

/// Returns the exponent of the lowest bit set in a number; none for zero.
std::optional<int> lowest_bit(double value) noexcept {
  if (value == 0 || !std::isfinite(value)) return std::nullopt;
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const auto whole = static_cast<std::int64_t>(std::ldexp(mantissa, 53));
  return exponent - 53 + std::countr_zero(static_cast<std::uint64_t>(whole));
}

Box3d widened(Box3d box, double by) noexcept {
  const Vec3d all = {by, by, by};
  box.low = box.low - all;
  box.high = box.high + all;
  return box;
}

/// Returns where ends are not kept from leaving the lattice by being moved to its rim.
Box3d within_lattice() noexcept {
  Box3d box;
  box.add(Vec3d{0, 0, 0});
  box.add(Vec3d{Lattice::kSpan, Lattice::kSpan, Lattice::kSpan});
  return box;
}

/// Returns the slabs that a box meets.
std::vector<SlabId> slabs_in(const SlabMesh& mesh, const Box3d& box) {
  std::vector<SlabId> slabs;
  mesh.visit_tree([&](const Box3d& b) { return b.meets(box); },
                  [&](SlabId s) {
                    slabs.push_back(s);
                    return false;
                  });
  std::ranges::sort(slabs);
  return slabs;
}

/// Returns the fibres of some slabs.
std::vector<FibreId> fibres_of(const SlabMesh& mesh, std::span<const SlabId> slabs) {
  std::vector<FibreId> fibres;
  for (const SlabId s : slabs)
    for (const FibreId f : mesh.slabs()[s].fibres) fibres.push_back(f);
  sort_unique(fibres);
  return fibres;
}
std::vector<SlabId> slabs_of(const SlabMesh& mesh, std::span<const FibreId> fibres) {
  std::vector<SlabId> slabs;
  for (const FibreId f : fibres)
    for (const SlabCorner c : mesh.fan(f)) slabs.push_back(c.slab);
  sort_unique(slabs);
  return slabs;
}

/// One piece of the cage in work.
class Work {
 public:
  Work(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals, RoomWay way,
       const Restrained& restrained, std::span<const FibreId> untested, const Progress& progress)
      : surface_(surface),
        mesh_(surface.slab_mesh()),
        wanted_(wanted),
        goals_(goals),
        way_(way),
        restrained_(restrained),
        untested_(untested),
        progress_(progress) {}

  Lengthened run() {
    Lengthened made;
    const std::vector<SlabId> candidates = candidate_slabs();
    if (candidates.empty()) return made;
    const double longest = goals_.longest * goals_.diagonal;
    // Fibres of these may move, and those next to them to make room for them.
    std::vector<FibreId> may_move = fibres_of(mesh_, slabs_of(mesh_, fibres_of(mesh_, candidates)));
    may_move.insert(may_move.end(), untested_.begin(), untested_.end());
    sort_unique(may_move);
    Box3d reach;
    for (const SlabId s : slabs_of(mesh_, may_move)) reach.add(mesh_.box(s));
    const std::vector<SlabId> slabs = slabs_in(mesh_, widened(reach, longest));
    Box3d box;
    for (const SlabId s : slabs) box.add(mesh_.box(s));
    const std::optional<Lattice> lattice = lattice_of(mesh_, box, longest);
    made.on_lattice = lattice.has_value();
    if (!lattice) return made;
    made.lattice = lattice_ = *lattice;
    solids_[kInner] = on_lattice(wanted_.cut, *lattice);
    solids_[kOuter] = on_lattice(wanted_.fill, *lattice);
    const ReachWanted wishes(surface_, *lattice, candidates, solids_[kInner], solids_[kOuter], goals_);
    number_fibres(slabs);
    const auto ends_now = [&](std::uint32_t f, std::size_t corner) {
      const Fibre& fibre = mesh_.fibres()[mesh_.slabs()[candidates[f]].fibres[corner]];
      return Ends{snap(lattice->to_lattice(fibre.inner)), snap(lattice->to_lattice(fibre.outer))};
    };
    made.before = lacks(wishes, candidates, *lattice, ends_now, made.overhang_before);
    made.after = made.before;
    made.overhang_after = made.overhang_before;
    if (made.before.empty() && made.overhang_before.wide == 0) return made;

    const SourceIndex nothing({}, {});
    const BoxTree no_tree = tree_of(nothing);
    ShellDraft draft = draft_of_slabs(slabs, *lattice);
    std::vector<std::uint8_t> fixed(draft.ends.size(), 1);
    for (const FibreId f : may_move)
      if (!std::ranges::binary_search(restrained_.staying, f)) fixed[local_.at(f)] = 0;
    const std::vector<Ends> old = draft.ends;
    ShellPatch patch(nothing, no_tree, longest / lattice->step, std::move(draft), fixed, progress_, within_lattice());
    made.is_sound = is_sound(patch);
    if (!made.is_sound) return made;
    const auto ends_in = [&](const std::vector<Ends>& by_fibre) {
      return [&](std::uint32_t f, std::size_t corner) {
        return by_fibre[local_.at(mesh_.slabs()[candidates[f]].fibres[corner])];
      };
    };
    made.lack_before = wants_of(patch, wishes, candidates, ends_in(old)).lack * lattice->step;
    std::vector<Ends> best = work_on(patch, slabs, wishes, candidates, ends_in(patch.draft().ends));
    if (progress_.cancelled()) return made;
    if (way_ == RoomWay::Shrink && best != old) {
      ShellDraft shrunk = draft_of_slabs(slabs, *lattice);
      shrunk.ends = best;
      ShellPatch given(nothing, no_tree, longest / lattice->step, std::move(shrunk), fixed, progress_,
                       within_lattice());
      const double lack = wants_of(given, wishes, candidates, ends_in(best)).lack;
      // First what no solid meets: that cannot lack for it.
      if (!give_back(given, old, fibres_met(wishes, candidates))) return made;
      best = given.draft().ends;
      if (!give_back(given, old, {})) return made;
      if (wants_of(given, wishes, candidates, ends_in(given.draft().ends)).lack <= lack) best = given.draft().ends;
    }
    made.lack_after = wants_of(patch, wishes, candidates, ends_in(best)).lack * lattice->step;
    made.overhang_after = {};
    made.after = lacks(wishes, candidates, *lattice, ends_in(best), made.overhang_after);
    for (std::uint32_t v = 0; v < old.size(); ++v) {
      const Ends& now = best[v];
      if (now == old[v]) continue;
      made.moved.push_back({global_[v], {lattice->to_model(now[kInner]), lattice->to_model(now[kOuter])}});
      const Vec3d was = to_double(old[v][kOuter] - old[v][kInner]), is = to_double(now[kOuter] - now[kInner]);
      made.lengthened += length(is) > length(was) + 1;
      constexpr double kTurned = 1e-4;  // sine: more than rounding
      made.turned += length(cross(normalized(was), normalized(is))) > kTurned;
    }
    std::ranges::sort(made.moved, {}, &MovedFibre::fibre);
    return made;
  }

 private:
  static constexpr double kRounding = 32;  ///< lattice steps: lengthen() leaves a few to it

  std::vector<SlabId> candidate_slabs() const {
    std::vector<SlabId> slabs;
    for (const std::vector<Capsule>* solids : {&wanted_.cut, &wanted_.fill})
      for (const Capsule& c : *solids) {
        const std::vector<SlabId> near = slabs_in(mesh_, box_of(c));
        slabs.insert(slabs.end(), near.begin(), near.end());
      }
    sort_unique(slabs);
    return slabs;
  }

  /// Returns whether the slabs around all untested fibres pass.
  [[nodiscard]] bool is_sound(ShellPatch& patch) const {
    if (untested_.empty()) return true;
    return std::ranges::none_of(patch.check(), [&](const ShellPatch::FibreFault& fault) {
      return std::ranges::binary_search(untested_, global_[fault.fibre]);
    });
  }

  void number_fibres(std::span<const SlabId> slabs) {
    global_ = fibres_of(mesh_, slabs);
    local_.reserve(global_.size());
    for (std::uint32_t v = 0; v < global_.size(); ++v) local_[global_[v]] = v;
  }

  [[nodiscard]] ShellDraft draft_of_slabs(std::span<const SlabId> slabs, const Lattice& lattice) const {
    ShellDraft draft;
    for (const SlabId s : slabs) {
      const auto& [a, b, c] = mesh_.slabs()[s].fibres;
      draft.faces.push_back({local_.at(a), local_.at(b), local_.at(c)});
    }
    if (Components parts = find_components(global_.size(), draft.faces); parts.count > 1)
      draft.component = std::move(parts.of_face);
    for (const FibreId f : global_) {
      const Fibre& fibre = mesh_.fibres()[f];
      draft.ends.push_back({snap(lattice.to_lattice(fibre.inner)), snap(lattice.to_lattice(fibre.outer))});
      const SlabCorner c = mesh_.fan(f).front();
      const GridPoint at = corner_point(mesh_.intervals(c.slab), c.corner);
      draft.at.push_back(lattice.to_lattice(sample_position(surface_, c.slab, at)));
    }
    draft.from.assign(draft.faces.size(), kNone);
    draft.lists.resize(draft.faces.size());
    return draft;
  }

  /// Returns the worst place of each slab, and the widest overhang.
  template <typename EndsOf>
  [[nodiscard]] std::vector<RoomLack> lacks(const ReachWanted& wishes, std::span<const SlabId> slabs,
                                            const Lattice& lattice, EndsOf&& ends,
                                            Lengthened::Overhang& overhang) const {
    std::vector<RoomLack> all;
    wishes.for_each_lack(ends, [&](const Lacking& l) {
      // What is filled covers nothing: only a tool that takes clay reaches under it.
      if (l.side == kInner && l.overhang * lattice.step > overhang.wide)
        overhang = {l.overhang * lattice.step, lattice.to_model(snap(l.near))};
      const double lack = l.short_of * lattice.step;
      if (!(lack > kNegligible * goals_.diagonal)) return;
      const RoomLack worst = {slabs[l.face], lattice.to_model(snap(l.near)), lack, l.way * lattice.step,
                              l.side == kInner};
      if (all.empty() || all.back().slab != worst.slab)
        all.push_back(worst);
      else if (lack > all.back().lack)
        all.back() = worst;
    });
    return all;
  }

  /// Holds what is wanted of the fibres as they stand.
  struct Wants {
    std::vector<ShellPatch::Reach> reach;  ///< by fibre
    std::vector<std::uint32_t> fibres;     ///< of slabs that lack
    std::vector<Vec3d> axes;               ///< by fibre, of the solid that reaches furthest there
    double lack = 0;                       ///< and what lies between surface and solids, summed over all places
    bool hangs = false;                    ///< solids lie beside some of them
  };
  template <typename EndsOf>
  [[nodiscard]] Wants wants_of(const ShellPatch& patch, const ReachWanted& wishes, std::span<const SlabId> slabs,
                               EndsOf&& ends) const {
    constexpr double kLeastWeight = 0.2;  // of a corner at a place that lacks: one with less does little for it
    Wants wants;
    wants.reach.resize(global_.size());
    wants.axes.resize(global_.size());
    wishes.for_each_lack(ends, [&](const Lacking& l) {
      if (!(l.lack > 0) && !(l.beside > 0)) return;
      wants.lack += l.lack + l.beside;
      wants.hangs = wants.hangs || l.beside > 0;
      for (std::size_t k = 0; k < 3; ++k) {
        if (!(l.weights[k] > 0)) continue;
        const std::uint32_t v = local_.at(mesh_.slabs()[slabs[l.face]].fibres[k]);
        wants.fibres.push_back(v);
        if (wants.axes[v] == Vec3d{}) wants.axes[v] = l.axis;
        if (l.weights[k] < kLeastWeight || !(l.lack > 0)) continue;
        double& reach = wants.reach[v][l.side];
        if (const double wanted = patch.reach(v)[l.side] + l.lack; wanted > reach) {
          reach = wanted;
          wants.axes[v] = l.axis;
        }
      }
    });
    sort_unique(wants.fibres);
    return wants;
  }

  /// Grow: turns towards the tool what would meet it from beside: before it is long, while it still can. Then
  /// lengthens, and turns by turns towards what sees best and towards the tool what does not come far enough. Shrink:
  /// makes all short first, and turns towards the tool only. Returns the ends with which least was lacking: a move that
  /// was of no use is not kept. `all`: the slabs of the patch.
  template <typename EndsOf>
  std::vector<Ends> work_on(ShellPatch& patch, std::span<const SlabId> all, const ReachWanted& wishes,
                            std::span<const SlabId> slabs, EndsOf&& ends) {
    constexpr int kRounds = 16;
    constexpr double kWorthIt = 0.99;  // of what is lacking: for less the surface is not sampled again
    const bool shrinks = way_ == RoomWay::Shrink;
    std::vector<Ends> best = patch.draft().ends;
    double least = Box3d::kFar;
    for (int round = 0;; ++round) {
      const Wants wants = wants_of(patch, wishes, slabs, ends);
      if (wants.lack < kWorthIt * least) {
        least = wants.lack;
        best = patch.draft().ends;
      }
      if (wants.fibres.empty() || round == kRounds) return best;
      progress_("room", double(round) / kRounds);
      const std::uint32_t before = patch.draft().clock;
      if (round == 0 && (shrinks || wants.hangs)) {
        if (shrinks) shrink(patch, all);
        turn(patch, wants, true);
        if (patch.draft().clock != before) continue;
      }
      ShellPatch::FailedSteps failed;
      if (!patch.lengthen(wants.reach, failed, progress_)) return best;
      if (is_short(patch, wants)) turn(patch, wants, shrinks || round % 2 == 1);
      if (progress_.cancelled() || patch.draft().clock == before) return best;
    }
  }

  /// Makes free fibres shorter on the sides on which there are solids, as far as the surface lets them: the margin
  /// stays between it and the triangles.
  void shrink(ShellPatch& patch, std::span<const SlabId> all) const {
    constexpr double kLeastShare = 0.25;  // of what it may give away: a fibre that cannot give as much keeps it
    const LinkedDraft& draft = patch.draft();
    std::vector<std::vector<SurfacePlace>> places(all.size());
    FibreMoves moves = patch.moves();
    for (std::uint32_t v = 0; v < draft.ends.size(); ++v) {
      if (progress_.cancelled()) return;
      if (!draft.can_move(v)) continue;
      const ShellPatch::Reach reach = patch.reach(v);
      ShellPatch::Reach spare = {};
      for (const Side side : {kInner, kOuter}) {
        if (solids_[side].empty()) continue;
        double least = reach[side];
        draft.for_ring(v, [&](std::uint32_t h) {
          const std::uint32_t f = h / 3;
          if (places[f].empty()) places[f] = places_on(surface_, lattice_, all[f]);
          least = std::min(least, spare_of(draft, f, h % 3, side, places[f]));
        });
        spare[side] = least > kRounding ? least : 0;
      }
      if (spare == ShellPatch::Reach{}) continue;
      for (double share = 1; share >= kLeastShare; share *= 0.5)
        if (moves.reach_to(v, {reach[kInner] - share * spare[kInner], reach[kOuter] - share * spare[kOuter]})) break;
    }
  }

  /// Returns how much shorter corner k of a slab may be on a side: the margin stays at all places.
  [[nodiscard]] double spare_of(const LinkedDraft& draft, std::uint32_t f, std::uint32_t k, Side side,
                                std::span<const SurfacePlace> places) const noexcept {
    const double margin = goals_.margin * goals_.diagonal / lattice_.step;
    double spare = Box3d::kFar;
    for (const SurfacePlace& place : places) {
      if (!(place.weights[k] > 0)) continue;
      std::array<Vec3d, 2> at;
      for (std::size_t c = 0; c < 3; ++c)
        for (const Side end : {kInner, kOuter})
          at[end] += to_double(draft.ends[draft.faces[f][c]][end]) * place.weights[c];
      const double reach = std::abs(dot(place.at - at[side], normalized(at[kOuter] - at[kInner])));
      spare = std::min(spare, (reach - margin) / place.weights[k]);
    }
    return spare;
  }

  /// Returns the fibres of slabs that solids may meet, ascending.
  [[nodiscard]] std::vector<std::uint32_t> fibres_met(const ReachWanted& wishes, std::span<const SlabId> slabs) const {
    std::vector<std::uint32_t> met;
    for (std::uint32_t f = 0; f < slabs.size(); ++f) {
      if (!wishes.may_lack(f)) continue;
      for (const FibreId fibre : mesh_.slabs()[slabs[f]].fibres) met.push_back(local_.at(fibre));
    }
    sort_unique(met);
    return met;
  }

  /// What has become shorter reaches as far as before, as far as that goes, so that later strokes find the same clay
  /// there; all but some fibres. False when cancelled.
  [[nodiscard]] bool give_back(ShellPatch& patch, std::span<const Ends> old,
                               std::span<const std::uint32_t> all_but) const {
    const LinkedDraft& draft = patch.draft();
    std::vector<std::uint32_t> fibres;
    std::vector<ShellPatch::Reach> wanted(old.size());
    for (std::uint32_t v = 0; v < old.size(); ++v) {
      if (draft.ends[v] == old[v] || std::ranges::binary_search(all_but, v)) continue;
      fibres.push_back(v);
      for (const Side side : {kInner, kOuter}) wanted[v][side] = length(to_double(old[v][side]) - draft.at[v]);
    }
    ShellPatch::FailedSteps failed;
    if (!patch.lengthen(wanted, failed, progress_)) return false;
    // What has not turned is what it was, to the bit.
    FibreMoves moves = patch.moves();
    for (const std::uint32_t v : fibres) {
      if (progress_.cancelled()) return false;
      const auto is_back = [&](Side side) {
        return length(to_double(draft.ends[v][side] - old[v][side])) <= 2 * kRounding;
      };
      if (is_back(kInner) && is_back(kOuter)) moves.put(v, draft.at[v], old[v]);
    }
    return true;
  }

  /// Returns whether some fibre could not be made as long as wanted.
  [[nodiscard]] static bool is_short(const ShellPatch& patch, const Wants& wants) noexcept {
    return std::ranges::any_of(wants.fibres, [&](std::uint32_t v) {
      const ShellPatch::Reach now = patch.reach(v);
      return wants.reach[v][kInner] - now[kInner] > kRounding || wants.reach[v][kOuter] - now[kOuter] > kRounding;
    });
  }

  void turn(ShellPatch& patch, const Wants& wants, bool to_tool) const {
    // Slabs may be narrower than their fibres are long: then a quarter of 65 degrees crosses a neighbour. Without the
    // eighths 5 of 33 deep cuts in a head fall short instead of 3.
    constexpr int kSmallTurns = 3;
    const int halvings = way_ == RoomWay::Shrink ? kSmallTurns : FibreMoves::kTurnHalvings;
    FibreMoves moves = patch.moves();
    Star star;
    for (const std::uint32_t v : wants.fibres) {
      if (progress_.cancelled()) return;
      if (!patch.draft().can_move(v) || std::ranges::binary_search(restrained_.straight, global_[v])) continue;
      if (to_tool) {
        if (wants.axes[v] != Vec3d{}) moves.turn(v, wants.axes[v], halvings);
        continue;
      }
      star.set_fibre(patch.draft(), v);
      moves.turn(v, star_direction(star.link(patch.draft()), patch.draft().at[v]).d);
    }
  }

  const Snapshot& surface_;
  const SlabMesh& mesh_;
  const RoomWanted& wanted_;
  const RoomGoals& goals_;
  const RoomWay way_;
  const Restrained& restrained_;
  std::span<const FibreId> untested_;
  const Progress& progress_;
  std::array<std::vector<Capsule>, 2> solids_;
  Lattice lattice_;
  std::vector<FibreId> global_;
  std::unordered_map<FibreId, std::uint32_t> local_;
};

}  // namespace

std::optional<int> lowest_bit_of(std::span<const Fibre> fibres) noexcept {
  std::optional<int> lowest;
  for (const Fibre& f : fibres)
    for (const Vec3d p : {f.inner, f.outer})
      for (std::size_t k = 0; k < 3; ++k)
        if (const auto bit = lowest_bit(p[k])) lowest = std::min(lowest.value_or(*bit), *bit);
  return lowest;
}

std::optional<Lattice> lattice_of(const SlabMesh& mesh, const Box3d& box, double room) {
  constexpr double kWhole = 1073741824.0;        // steps that the verifier takes, 2^30
  constexpr double kExact = 4503599627370496.0;  // steps from zero to which doubles hold lattice points, 2^52
  constexpr double kSpare = 4;                   // steps lost to rounding the origin down
  const std::optional<int> lowest = lowest_bit_of(mesh.fibres());
  if (!lowest) return std::nullopt;
  Box3d whole = mesh.bounds();
  whole.add(widened(box, room));
  double widest = 0, widest_of_all = 0, farthest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    widest = std::max(widest, box.extent()[k]);
    widest_of_all = std::max(widest_of_all, whole.extent()[k]);
    farthest = std::max({farthest, std::abs(whole.low[k]), std::abs(whole.high[k])});
  }
  const auto fits = [&](double step) {
    return widest <= (Lattice::kSpan - kSpare) * step && widest_of_all <= (kWhole - kSpare) * step &&
           farthest <= kExact * step;
  };
  Lattice lattice;
  lattice.step = std::ldexp(1.0, *lowest);
  if (!fits(lattice.step)) return std::nullopt;
  // A cage of round numbers leaves room for a finer one.
  while (widest + 2 * room <= (Lattice::kSpan - kSpare) * 0.5 * lattice.step && fits(0.5 * lattice.step))
    lattice.step *= 0.5;
  for (std::size_t k = 0; k < 3; ++k) {
    const double spare = std::min(room, 0.5 * ((Lattice::kSpan - kSpare) * lattice.step - box.extent()[k]));
    lattice.origin[k] = (std::floor((box.low[k] - spare) / lattice.step) - 1) * lattice.step;
  }
  return lattice;
}

void Restrained::add(std::span<const FibreId> failed) {
  std::vector<FibreId> first;
  for (const FibreId f : failed) (std::ranges::binary_search(straight, f) ? staying : first).push_back(f);
  straight.insert(straight.end(), first.begin(), first.end());
  sort_unique(straight);
  sort_unique(staying);
}

Lengthened lengthen_for(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals, RoomWay way,
                        const Restrained& restrained, std::span<const FibreId> untested, const Progress& progress) {
  return Work(surface, wanted, goals, way, restrained, untested, progress).run();
}

}  // namespace relief::detail
