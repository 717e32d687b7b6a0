#include <relief/convert/shell/slab_checks.h>

#include <algorithm>
#include <bit>
#include <span>

namespace relief::detail {
namespace {

/// The triangles from which on a cluster is listed as a whole: the list is shorter and one test settles all, at the
/// price of some triangles outside the slab.
constexpr std::size_t kWorthACluster = kClusterSize / 2;

/// Boxes per slab from which the tree is built again: most are empty then, and a smaller tree is quicker.
constexpr double kBoxesPerSlab = 1.8;

/// The share of a triangle that is outside, on average over those that cross a slab's end.
constexpr double kHalfOutside = 0.5;

Fault fault_of(Meeting m) noexcept {
  return m == Meeting::Outer    ? Fault::Outer
         : m == Meeting::Inner  ? Fault::Inner
         : m == Meeting::Folded ? Fault::Folded
                                : Fault::None;
}

}  // namespace

void SlabChecks::FourBoxes::set(std::size_t k, const FloatBox& box) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis].of[k] = box.low[axis];
    high[axis].of[k] = box.high[axis];
  }
}

unsigned SlabChecks::FourBoxes::meeting(const FloatBox& box) const noexcept {
  return bits_of((low[0].all() <= box.high[0]) & (high[0].all() >= box.low[0]) & (low[1].all() <= box.high[1]) &
                 (high[1].all() >= box.low[1]) & (low[2].all() <= box.high[2]) & (high[2].all() >= box.low[2]));
}

void SlabChecks::FourFaces::set(std::size_t k, const Face& face, const SlabShape& shape) noexcept {
  for (const Side side : {kInner, kOuter}) boxes[side].set(k, FloatBox::around(shape.box(side)));
  for (std::size_t corner = 0; corner < 3; ++corner) corners[corner][k] = face[corner];
}

unsigned SlabChecks::FourFaces::joined_to(const Face& face) const noexcept {
  FourMask joined{};
  for (const std::array<std::uint32_t, 4>& mine : corners) {
    const auto all = std::bit_cast<FourInts>(mine);
    for (const std::uint32_t v : face) joined |= all == static_cast<std::int32_t>(v);
  }
  return bits_of(joined);
}

void SlabChecks::CodeSet::reset(std::size_t most) {
  const std::size_t size = std::bit_ceil(2 * most + 16);
  if (slots_.size() < size) {
    slots_.assign(size, {});
    round_ = 0;
  }
  mask_ = size - 1;
  ++round_;
}

bool SlabChecks::CodeSet::add(std::uint32_t code) {
  std::size_t at = first_slot(code);
  for (; slots_[at].round == round_; at = (at + 1) & mask_)
    if (slots_[at].code == code) return false;
  slots_[at] = {code, round_};
  return true;
}

bool SlabChecks::CodeSet::has(std::uint32_t code) const {
  for (std::size_t at = first_slot(code); slots_[at].round == round_; at = (at + 1) & mask_)
    if (slots_[at].code == code) return true;
  return false;
}

void SlabChecks::build_boxes(const LinkedDraft& draft) {
  boxed_.clear();
  side_boxes_.clear();
  place_of_.resize(draft.faces.size(), kNone);
  replaced_in_.resize(draft.faces.size(), 0);
  for (std::uint32_t f = 0; f < draft.faces.size(); ++f) {
    if (!draft.alive(f)) continue;
    place_of_[f] = static_cast<std::uint32_t>(boxed_.size());
    boxed_.push_back(f);
    side_boxes_.push_back(boxes_around({draft.triangle(f, kInner), draft.triangle(f, kOuter)}));
  }
  boxes_.emplace(boxed_.size(), [&](std::size_t k) { return draft.box(boxed_[k]); }, false);
}

bool SlabChecks::is_within(const Box3d& box) const noexcept {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(box.low[k] > room_.low[k] && box.high[k] < room_.high[k])) return false;
  return true;
}

SlabChecks::SideBoxes SlabChecks::boxes_around(const SideTriangles& slab) noexcept {
  return {FloatBox::around(LatticeBox(slab[kInner])), FloatBox::around(LatticeBox(slab[kOuter]))};
}

/// Returns the union of the lists of the faces that the star replaces, in the source's order.
void SlabChecks::gather(const LinkedDraft& draft) {
  if (gathered_) return;
  gathered_ = true;
  laid_out_ = false;
  lost_before_.reset();
  held_.clear();
  culprit_ = kNone;
  rival_ = {};
  failed_ = 0;
  ++gathering_;
  std::size_t most = 0;
  star_.for_replaced([&](std::uint32_t f) {
    replaced_in_[f] = gathering_;
    most += draft.lists.of(f).size();
  });
  codes_.reset(most);
  star_.for_replaced([&](std::uint32_t f) {
    for (const TriangleReference r : draft.lists.of(f))
      if (r.is_cluster() && codes_.add(r.code)) held_.push_back(r);
  });
  const bool has_clusters = !held_.empty();
  star_.for_replaced([&](std::uint32_t f) {
    for (const TriangleReference r : draft.lists.of(f)) {
      if (r.is_cluster() || (has_clusters && codes_.has(TriangleReference::cluster(r.first() / kClusterSize).code)))
        continue;
      if (codes_.add(r.code)) held_.push_back(r);
    }
  });
  std::sort(held_.begin(), held_.end());
  if (tolerance_.loss == 0) return;
  areas_.clear();
  held_area_ = 0;
  for (const TriangleReference r : held_) held_area_ += areas_.emplace_back(0.5 * length(source_.cross_of(r.first())));
}

/// Puts what was gathered side by side, for the tests of slabs.
void SlabChecks::lay_out(const LinkedDraft& draft) {
  if (laid_out_) return;
  laid_out_ = true;
  origin_ = draft.ends[star_.faces[star_.fresh][1]][kInner];
  pieces_.resize((held_.size() + 3) / 4);
  spread_.assign(held_.size(), kNone);
  spread_count_ = 0;
  for (std::size_t four = 0; four < pieces_.size(); ++four) {
    const auto some = std::span(held_).subspan(4 * four, std::min<std::size_t>(4, held_.size() - 4 * four));
    source_.set_four(pieces_[four], some.size(), origin_, [&](std::size_t k) { return some[k].first(); });
    for (std::size_t k = 0; k < some.size(); ++k)
      if (some[k].is_cluster()) pieces_[four].set(k, source_.clusters[some[k].first() / kClusterSize], origin_);
  }
}

Fault SlabChecks::check(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare) {
  if (const Fault fault = check_itself(draft, ends, spare); fault != Fault::None) return fault;
  return check_others(draft);
}

bool SlabChecks::passes(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare) {
  return check_itself(draft, ends, spare) == Fault::None && !meets_last_rival(draft) &&
         check_others(draft) == Fault::None;
}

/// What asks neither other slabs nor much of the source.
Fault SlabChecks::check_itself(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare) {
  ends_ = ends;
  spare_ = spare;
  lost_ = 0;
  if (star_.moved != kNone && !winds_once(draft)) return Fault::Winding;
  if (const Fault fault = make_shapes(draft); fault != Fault::None) return fault;
  gather(draft);
  // What failed last is likely to fail again; slabs near a star are few, its source may be much.
  return check_last_culprit();
}

Fault SlabChecks::check_others(const LinkedDraft& draft) {
  if (const Fault fault = check_overlap(draft); fault != Fault::None) return fault;
  lay_out(draft);
  return check_source();
}

/// C2: the link, seen along the fibre, comes round once.
bool SlabChecks::winds_once(const LinkedDraft& draft) const {
  const LatticePoint centre = ends_[kInner], d = ends_[kOuter] - centre;
  const LatticePoint start = draft.ends[star_.faces[0][1]][kInner] - centre;
  int turns = 0, last = 0;
  for (std::size_t k = 1; k <= star_.faces.size(); ++k) {
    const int sign =
        k == star_.faces.size() ? 0 : determinant_sign(d, start, draft.ends[star_.faces[k][1]][kInner] - centre);
    turns += last < 0 && sign >= 0;
    last = sign;
  }
  return turns == 1;
}

/// Returns the new slabs, with C1.
Fault SlabChecks::make_shapes(const LinkedDraft& draft) {
  const auto end = [&](std::uint32_t v, Side side) { return v == star_.moved ? ends_[side] : draft.ends[v][side]; };
  triangles_.clear();
  for (std::size_t k = star_.fresh; k < star_.faces.size(); ++k) {
    const Face& f = star_.faces[k];
    const auto& [in, out] = triangles_.emplace_back(
        SideTriangles{LatticeTriangle{end(f[0], kInner), end(f[1], kInner), end(f[2], kInner)},
                      LatticeTriangle{end(f[0], kOuter), end(f[1], kOuter), end(f[2], kOuter)}});
    if (jacobian_fault(in, out) != JacobianFault::None) return Fault::Jacobian;
    Box3d box;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      box.add(to_double(in[corner]));
      box.add(to_double(out[corner]));
    }
    if (!is_within(box)) return Fault::Outside;
  }
  shapes_.clear();
  for (const auto& [in, out] : triangles_) shapes_.emplace_back(in, out);
  return Fault::None;
}

/// C5 and C6 of the triangle that failed last.
Fault SlabChecks::check_last_culprit() {
  if (culprit_ == kNone || tolerance_.folds > 0) return Fault::None;
  const SourceTriangle t = source_.triangle(culprit_);
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    if (const Fault fault = fault_of(shapes_[k].meet(t)); fault != Fault::None) {
      failed_ = k;
      return fault;
    }
  return Fault::None;
}

/// C3 of the two triangles that met last.
bool SlabChecks::meets_last_rival(const LinkedDraft& draft) const {
  return rival_.slab != kNone &&
         triangles_meet(shapes_[rival_.shape].triangle(rival_.mine), draft.triangle(rival_.slab, rival_.side));
}

bool SlabChecks::would_clear(Side side, LatticePoint end) const noexcept {
  SideTriangles slab = triangles_[failed_];
  slab[side][0] = end;
  const Meeting m = SlabShape(slab[kInner], slab[kOuter]).meet(source_.triangle(culprit_));
  return m != (side == kOuter ? Meeting::Outer : Meeting::Inner);
}

/// C3 of inner against outer triangles of the change itself. Those of one side have corners in common and may be left
/// out where C1 and C2 hold.
bool SlabChecks::overlap_among_themselves() const {
  for (const SlabShape& s : shapes_)
    for (const SlabShape& t : shapes_) {
      if (!s.box(kInner).meets(t.box(kOuter)) || s.surely_apart(kInner, t, kOuter)) continue;
      if (triangles_meet(s.triangle(kInner), t.triangle(kOuter))) return true;
    }
  return false;
}

/// C3, inner against outer included.
Fault SlabChecks::check_overlap(const LinkedDraft& draft) {
  if (overlap_among_themselves()) return Fault::InnerOverlap;
  const std::size_t count = shapes_.size();
  Box3d all;
  for (const SlabShape& s : shapes_) all.add(s.box());
  const FloatBox bounds = FloatBox::around(all);
  const BoxProbe probe(bounds);
  const std::uint32_t component = draft.component_of(star_.slots[star_.fresh]);
  Fault fault = Fault::None;
  fours_.assign((count + 3) / 4, {});
  for (std::size_t k = 0; k < count; ++k) fours_[k / 4].set(k % 4, star_.faces[star_.fresh + k], shapes_[k]);
  boxes_->query(all, [&](std::uint32_t place) {
    const std::uint32_t g = boxed_[place];
    if (replaced_in_[g] == gathering_) return true;
    const SideBoxes& theirs = side_boxes_[place];
    const std::array<bool, 2> is_near = {probe.meets(theirs[kInner]), probe.meets(theirs[kOuter])};
    if (!is_near[kInner] && !is_near[kOuter]) return true;
    if (draft.component_of(g) != component) {
      // C4: a component that is small beside a slab must not be swallowed whole.
      const LatticePoint end = draft.ends[draft.faces[g][0]][kOuter];
      for (const SlabShape& s : shapes_)
        if (s.box().contains(to_double(end)) && in_hull(s.triangle(kInner), s.triangle(kOuter), end)) {
          fault = Fault::OuterOverlap;
          return false;
        }
    }
    for (std::size_t four = 0; four < fours_.size(); ++four) {
      const unsigned joined = fours_[four].joined_to(draft.faces[g]);
      for (const Side mine : {kOuter, kInner})
        for (const Side side : {kOuter, kInner}) {
          if (!is_near[side]) continue;
          unsigned left = fours_[four].boxes[mine].meeting(theirs[side]);
          if (mine == side) left &= ~joined;
          for (; left != 0; left &= left - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(left));
            const SlabShape& shape = shapes_[4 * four + lane];
            const LatticeTriangle other = draft.triangle(g, side);
            if (shape.surely_apart(mine, other) || !triangles_meet(shape.triangle(mine), other)) continue;
            rival_ = {g, 4 * four + lane, mine, side};
            fault = mine == kOuter ? Fault::OuterOverlap : Fault::InnerOverlap;
            return false;
          }
        }
    }
    return true;
  });
  return fault;
}

/// Returns the fault of a piece that is in a slab, if there is one: folds, and what may be lost, pass as long as there
/// is area to spare.
Fault SlabChecks::judge(Meeting m, std::uint32_t triangle, double& spare_folds) {
  if (m == Meeting::Folded && tolerance_.folds_at_will()) return Fault::None;
  if (spare_ && (m == Meeting::Outer || m == Meeting::Inner)) {
    lost_ += kHalfOutside * 0.5 * length(source_.cross_of(triangle));
    return lost_ <= *spare_ ? Fault::None : Fault::Lost;
  }
  if (m == Meeting::Folded && spare_folds > 0) {
    spare_folds -= 0.5 * length(source_.cross_of(triangle));
    if (spare_folds >= 0) return Fault::None;
  }
  return fault_of(m);
}

/// Lists the triangles of a cluster that does not fit as a whole.
Fault SlabChecks::check_cluster(const SlabShape& shape, const QuickShape& quick, std::size_t piece, bool is_within,
                                double& spare_folds) {
  const std::uint32_t first = held_[piece].first();
  const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(kClusterSize, source_.faces.size() - first));
  if (spread_[piece] == kNone) {
    spread_[piece] = spread_count_++;
    if (spread_clusters_.size() < spread_count_) spread_clusters_.emplace_back();
    auto& fours = spread_clusters_[spread_[piece]];
    for (std::uint32_t k = 0; k < count; k += 4)
      source_.set_four(fours[k / 4], std::min<std::size_t>(4, count - k), origin_,
                       [&](std::size_t lane) { return first + k + static_cast<std::uint32_t>(lane); });
  }
  const auto& fours = spread_clusters_[spread_[piece]];
  for (std::uint32_t k = 0; k < count; k += 4) {
    const QuickShape::Verdict verdict =
        is_within ? QuickShape::Verdict{(1U << std::min(4U, count - k)) - 1, quick.crossed(fours[k / 4])}
                  : quick.meet(fours[k / 4]);
    for (unsigned left = verdict.near; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint32_t t = first + k + lane;
      if ((verdict.section >> lane & 1U) == 0) {
        const Meeting m = shape.meet(source_.triangle(t));
        if (m == Meeting::Apart) continue;
        if (const Fault fault = judge(m, t, spare_folds); fault != Fault::None) {
          culprit_ = t;
          return fault;
        }
      }
      lists_.push_back(TriangleReference::triangle(t));
    }
  }
  return Fault::None;
}

/// C5 and C6.
Fault SlabChecks::check_source() {
  if (spare_) met_.assign(held_.size(), 0);
  lists_.clear();
  ranges_.resize(shapes_.size());
  // Where the last check failed this one is likely to, too.
  for (std::size_t step = 0; step < shapes_.size(); ++step) {
    const std::size_t slab = step == 0 ? failed_ : step <= failed_ ? step - 1 : step;
    if (const Fault fault = check_slab(slab); fault != Fault::None) {
      failed_ = slab;
      return fault;
    }
  }
  for (std::size_t k = 0; spare_ && k < met_.size(); ++k)
    if (met_[k] == 0) lost_ += areas_[k];
  return spare_ && lost_ > *spare_ ? Fault::Lost : Fault::None;
}

/// C5 and C6 of one slab, with its list.
Fault SlabChecks::check_slab(std::size_t slab) {
  const SlabShape& shape = shapes_[slab];
  const auto begin = static_cast<std::uint32_t>(lists_.size());
  const QuickShape quick(shape, origin_);
  double spare_folds = tolerance_.folds * shape.middle_area();
  for (std::size_t four = 0; four < pieces_.size(); ++four) {
    const QuickShape::Verdict verdict = quick.meet(pieces_[four]);
    for (unsigned left = verdict.near; left != 0; left &= left - 1) {
      const std::size_t k = 4 * four + static_cast<std::size_t>(std::countr_zero(left));
      const TriangleReference r = held_[k];
      if (r.is_cluster()) {
        const Meeting whole = shape.meet(source_.clusters[r.first() / kClusterSize]);
        if (whole == Meeting::Section) lists_.push_back(r);
        if (whole == Meeting::Section || whole == Meeting::Apart) continue;
        const Fault fault = check_cluster(shape, quick, k, whole == Meeting::Within, spare_folds);
        if (fault != Fault::None) return fault;
        continue;
      }
      if ((verdict.section >> (k % 4) & 1U) == 0) {
        const Meeting m = shape.meet(source_.triangle(r.first()));
        if (m == Meeting::Apart) continue;
        if (const Fault fault = judge(m, r.first(), spare_folds); fault != Fault::None) {
          culprit_ = r.first();
          return fault;
        }
      }
      if (spare_) met_[k] = 1;
      lists_.push_back(r);
    }
  }
  if (tolerance_.loss == 0) join_clusters(begin);
  if (lists_.size() == begin && !source_.faces.empty()) return Fault::Empty;
  ranges_[slab] = {begin, static_cast<std::uint32_t>(lists_.size()) - begin};
  return Fault::None;
}

/// Lists as a whole the clusters of which many triangles are listed, from `begin` on.
void SlabChecks::join_clusters(std::size_t begin) {
  std::size_t kept = begin;
  for (std::size_t k = begin; k < lists_.size();) {
    std::size_t stop = k + 1;
    const TriangleReference r = lists_[k];
    if (!r.is_cluster()) {
      while (stop < lists_.size() && !lists_[stop].is_cluster() &&
             lists_[stop].first() / kClusterSize == r.first() / kClusterSize)
        ++stop;
    }
    if (stop - k >= kWorthACluster)
      lists_[kept++] = TriangleReference::cluster(r.first() / kClusterSize);
    else
      for (std::size_t j = k; j < stop; ++j) lists_[kept++] = lists_[j];
    k = stop;
  }
  lists_.resize(kept);
}

double SlabChecks::lost_now(const LinkedDraft& draft) {
  if (tolerance_.loss == 0) return 0;
  gather(draft);
  if (!lost_before_) {
    // Found or not, what was lost until then is counted.
    (void)check(draft, draft.ends[star_.moved], Box3d::kFar);
    spare_.reset();
    lost_before_ = lost_;
  }
  return *lost_before_;
}

void SlabChecks::commit(LinkedDraft& draft) {
  for (const std::uint32_t f : star_.vanished) {
    draft.lists.clear(f);
    boxes_->set(place_of_[f], {});
  }
  const std::span<const TriangleReference> lists = lists_;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const std::uint32_t f = star_.slots[star_.fresh + k];
    draft.lists.replace(f, lists.subspan(ranges_[k].begin, ranges_[k].count));
    boxes_->set(place_of_[f], shapes_[k].box());
    side_boxes_[place_of_[f]] = boxes_around(triangles_[k]);
  }
  gathered_ = false;
  draft.lists.pack_if_stale();
  if (kBoxesPerSlab * double(draft.alive_count) < double(boxed_.size())) build_boxes(draft);
}

}  // namespace relief::detail
