#include <relief/base/free_memory.h>
#include <relief/base/lanes.h>
#include <relief/convert/slab_reducer.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>

namespace relief::detail {

void SlabReducer::FourBoxes::set(std::size_t k, const FloatBox& box) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis].of[k] = box.low[axis];
    high[axis].of[k] = box.high[axis];
  }
}

unsigned SlabReducer::FourBoxes::meeting(const FloatBox& box) const noexcept {
  return bits_of((low[0].all() <= box.high[0]) & (high[0].all() >= box.low[0]) & (low[1].all() <= box.high[1]) &
                 (high[1].all() >= box.low[1]) & (low[2].all() <= box.high[2]) & (high[2].all() >= box.low[2]));
}

void SlabReducer::FourFaces::set(std::size_t k, const Face& face, const SlabShape& shape) noexcept {
  for (const Side side : {kInner, kOuter}) boxes[side].set(k, FloatBox::around(shape.box(side)));
  for (std::size_t corner = 0; corner < 3; ++corner) corners[corner][k] = face[corner];
}

unsigned SlabReducer::FourFaces::joined_to(const Face& face) const noexcept {
  FourMask joined{};
  for (const std::array<std::uint32_t, 4>& mine : corners) {
    const auto all = std::bit_cast<FourInts>(mine);
    for (const std::uint32_t v : face) joined |= all == static_cast<std::int32_t>(v);
  }
  return bits_of(joined);
}

void SlabReducer::Seen::reset(std::size_t most) {
  const std::size_t size = std::bit_ceil(2 * most + 16);
  if (slots_.size() < size) {
    slots_.assign(size, {});
    round_ = 0;
  }
  mask_ = size - 1;
  ++round_;
}

bool SlabReducer::Seen::add(std::uint32_t code) {
  std::size_t at = (code * 0x9e3779b1U >> 7U) & mask_;
  for (; slots_[at].round == round_; at = (at + 1) & mask_)
    if (slots_[at].code == code) return false;
  slots_[at] = {code, round_};
  return true;
}

bool SlabReducer::Seen::has(std::uint32_t code) const {
  std::size_t at = (code * 0x9e3779b1U >> 7U) & mask_;
  for (; slots_[at].round == round_; at = (at + 1) & mask_)
    if (slots_[at].code == code) return true;
  return false;
}

SlabReducer::SlabReducer(const OrderedSource& source, const BoxTree& tree, double longest, CageDraft&& cage,
                         const Box3d& room, const Progress& progress)
    : source_(source), longest_(longest), room_(room), cage_(std::move(cage)) {
  const std::size_t points = cage_.ends.size(), faces = cage_.faces.size();
  twins_ = find_twins(cage_.faces, points);
  out_.assign(points, kNone);
  valences_.assign(points, 0);
  for (std::uint32_t h = 0; h < 3 * faces; ++h) {
    out_[origin(h)] = h;
    ++valences_[origin(h)];
  }
  fixed_.assign(points, 0);
  for (std::uint32_t f = 0; f < faces; ++f) {
    const Box3d box = cage_.box(f);
    if (is_within(box)) {
      ++free_;
      continue;
    }
    for (const std::uint32_t v : cage_.faces[f]) fixed_[v] = 1;
  }
  stamps_.assign(points, 0);
  touched_.assign(points, kAtFirst);
  improved_.assign(points, 0);
  tried_.assign(3 * faces, 0);
  mark_.assign(points, 0);
  place_of_.assign(faces, kNone);
  in_star_.assign(faces, 0);
  alive_ = faces;
  find_lists(tree, progress);
}

bool SlabReducer::is_within(const Box3d& box) const noexcept {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(box.low[k] > room_.low[k] && box.high[k] < room_.high[k])) return false;
  return true;
}

void SlabReducer::find_lists(const BoxTree& tree, const Progress& progress) {
  constexpr std::size_t kUsual = 24;  // entries per slab, with those that are stale; what is not used stays untouched
  cage_.pool.reserve(kUsual * cage_.faces.size());
  std::vector<std::uint32_t> near;
  for (std::uint32_t f = 0; f < cage_.faces.size(); ++f) {
    if ((f & 255U) == 0 && progress.cancelled()) return;
    if (cage_.from[f] == kNone) {
      listed_ += cage_.lists[f].count;
      continue;
    }
    const Face& face = cage_.faces[f];
    if (!is_free(face[0]) && !is_free(face[1]) && !is_free(face[2])) continue;
    cage_.from[f] = kNone;
    const SlabShape shape(cage_.triangle(f, kInner), cage_.triangle(f, kOuter));
    List& list = cage_.lists[f];
    list = {static_cast<std::uint32_t>(cage_.pool.size()), 0};
    near.clear();
    tree.query(shape.box(), [&](std::uint32_t t) {
      near.push_back(t);
      return true;
    });
    source_.for_near(shape, near, [&](std::uint32_t t, bool is_section) {
      if (is_section || !shape.is_apart(source_.triangle(t))) cage_.pool.push_back(Entry::triangle(t));
    });
    list.count = static_cast<std::uint32_t>(cage_.pool.size()) - list.begin;
    listed_ += list.count;
  }
  cage_.pool.reserve(most_listed());
  free_memory(cage_.from);
}

void SlabReducer::build_boxes() {
  boxed_.clear();
  for (std::uint32_t f = 0; f < cage_.faces.size(); ++f) {
    if (!alive(f)) continue;
    place_of_[f] = static_cast<std::uint32_t>(boxed_.size());
    boxed_.push_back(f);
  }
  boxes_.emplace(boxed_.size(), [&](std::size_t k) { return cage_.box(boxed_[k]); }, false);
}

SlabReducer::SideBoxes SlabReducer::boxes_of(std::uint32_t f) const noexcept {
  SideBoxes boxes;
  for (const Side side : {kInner, kOuter}) boxes[side] = FloatBox::around(LatticeBox(cage_.triangle(f, side)));
  return boxes;
}

/// What merging the ends of an edge costs, and where they would go.
Merge SlabReducer::weigh(std::uint32_t u, std::uint32_t v) const noexcept {
  Quadric q = cage_.quadrics[u];
  q += cage_.quadrics[v];
  return merge_ends(q, cage_.at[u], cage_.at[v]);
}

void SlabReducer::push(std::uint32_t h) {
  const auto [u, v] = std::minmax({origin(h), target(h)});
  queue_.push_back({weigh(u, v).cost, u, v, stamps_[u], stamps_[v]});
}

void SlabReducer::fill_queue() {
  const auto for_untried = [&](auto&& visit) {
    for (std::uint32_t h = 0; h < twins_.size(); ++h)
      if (is_free_edge(h) && std::max(touched_[origin(h)], touched_[target(h)]) > tried_[h]) visit(h);
  };
  std::size_t untried = 0;
  for_untried([&](std::uint32_t) { ++untried; });
  queue_.clear();
  queue_.reserve(untried + untried / 8);
  for_untried([&](std::uint32_t h) { push(h); });
  std::make_heap(queue_.begin(), queue_.end());
}

void SlabReducer::touch(std::uint32_t v) {
  ++clock_;
  touched_[v] = clock_;
  for_ring(v, [&](std::uint32_t h) { touched_[target(h)] = clock_; });
}

// The two ends have two neighbours in common, the far corners of the edge's faces, and neither these nor the merged
// vertex come to have fewer than three faces.
bool SlabReducer::link_allows(std::uint32_t h) {
  const std::uint32_t u = origin(h), v = target(h);
  const int around = valences_[u] + valences_[v];
  if (around < 7 || around > 18) return false;
  ++mark_round_;
  std::size_t shared = 0;
  for_ring(u, [&](std::uint32_t e) { mark_[target(e)] = mark_round_; });
  for_ring(v, [&](std::uint32_t e) { shared += mark_[target(e)] == mark_round_; });
  if (shared != 2) return false;
  return valences_[target(next_of(h))] > 3 && valences_[target(next_of(twins_[h]))] > 3;
}

void SlabReducer::star_of(std::uint32_t v) {
  trial_.faces.clear();
  trial_.slots.clear();
  trial_.vanished.clear();
  trial_.fresh = 0;
  trial_.moved = v;
  for_ring(v, [&](std::uint32_t h) {
    trial_.faces.push_back({v, target(h), target(next_of(h))});
    trial_.slots.push_back(h / 3);
  });
  gathered_ = false;
}

// The star of the vertex that an edge becomes: from its left far corner around the first end to the right one, and
// back around the second.
bool SlabReducer::star_of_edge(std::uint32_t h) {
  const std::uint32_t u = origin(h);
  trial_.faces.clear();
  trial_.slots.clear();
  trial_.vanished.clear();
  trial_.fresh = 0;
  trial_.moved = u;
  for (const std::uint32_t start : {h, twins_[h]}) {
    trial_.second = trial_.faces.size();
    trial_.vanished.push_back(start / 3);
    const std::uint32_t stop = next_of(twins_[start]);  // the first edge after the twin's face is reached
    for (std::uint32_t e = twins_[last_of(start)]; e != stop; e = twins_[last_of(e)]) {
      trial_.faces.push_back({u, target(e), target(next_of(e))});
      trial_.slots.push_back(e / 3);
      if (trial_.faces.size() > 20) return false;
    }
  }
  gathered_ = false;
  return trial_.faces.size() >= 3;
}

/// The union of the lists of the faces that a trial replaces, in the source's order.
void SlabReducer::gather() {
  if (gathered_) return;
  gathered_ = true;
  aim_.reset();
  lost_before_.reset();
  union_.clear();
  hint_ = kNone;
  failed_ = 0;
  ++star_round_;
  std::size_t most = 0;
  const auto for_faces = [&](auto&& visit) {
    for (std::size_t k = trial_.fresh; k < trial_.slots.size(); ++k) visit(trial_.slots[k]);
    for (const std::uint32_t f : trial_.vanished) visit(f);
  };
  for_faces([&](std::uint32_t f) {
    in_star_[f] = star_round_;
    most += cage_.lists[f].count;
  });
  seen_.reset(most);
  for_faces([&](std::uint32_t f) {
    for (const Entry e : cage_.list(f))
      if (e.is_block() && seen_.add(e.code)) union_.push_back(e);
  });
  const bool blocks = !union_.empty();
  for_faces([&](std::uint32_t f) {
    for (const Entry e : cage_.list(f)) {
      if (e.is_block() || (blocks && seen_.has(Entry::block(e.first() / kBlock).code))) continue;
      if (seen_.add(e.code)) union_.push_back(e);
    }
  });
  std::sort(union_.begin(), union_.end());
  laid_out_ = false;
  if (tolerance_.loss == 0) return;
  areas_.clear();
  area_ = 0;
  for (const Entry e : union_) area_ += areas_.emplace_back(0.5 * length(source_.cross_of(e.first())));
}

/// Puts what was gathered side by side, for the tests of slabs.
void SlabReducer::lay_out() {
  if (laid_out_) return;
  laid_out_ = true;
  origin_ = cage_.ends[trial_.faces[trial_.fresh][1]][kInner];
  pieces_.resize((union_.size() + 3) / 4);
  spread_.assign(union_.size(), kNone);
  spread_count_ = 0;
  for (std::size_t four = 0; four < pieces_.size(); ++four) {
    const auto entries = std::span(union_).subspan(4 * four, std::min<std::size_t>(4, union_.size() - 4 * four));
    source_.set_four(pieces_[four], entries.size(), origin_, [&](std::size_t k) { return entries[k].first(); });
    for (std::size_t k = 0; k < entries.size(); ++k)
      if (entries[k].is_block()) pieces_[four].set(k, source_.blocks[entries[k].first() / kBlock], origin_);
  }
}

double SlabReducer::least_lean(Vec3d d) const noexcept {
  double least = 1;
  for (const Vec3d n : normals_) least = std::min(least, dot(n, d));
  return least;
}

Direction SlabReducer::aim() {
  if (!aim_) aim_ = find_aim();
  return *aim_;
}

/// Of the triangles aimed at those whose normals reach farthest along twelve directions across the mean, and the one
/// that leans farthest from it.
std::vector<std::uint32_t> SlabReducer::outermost(Vec3d mean) const {
  const Vec3d aside = std::abs(mean.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d e = normalized(cross(mean, aside)), g = cross(mean, e);
  constexpr std::size_t kAxes = 6;  // each stands for two directions
  // Four axes at a time; the last two of the eight both point away from the mean.
  std::array<std::array<Lanes, 3>, 2> axes;
  for (std::size_t k = 0; k < 8; ++k) {
    const double angle = std::numbers::pi * double(k) / kAxes;
    const Vec3d axis = k < kAxes ? e * std::cos(angle) + g * std::sin(angle) : -mean;
    for (std::size_t c = 0; c < 3; ++c) axes[k / 4][c].of[k % 4] = static_cast<float>(axis[c]);
  }
  std::array<Four, 2> highest{}, lowest{};
  std::array<FourInts, 2> at_highest{}, at_lowest{};
  highest.fill(Four{} - 2.0F);
  lowest.fill(Four{} + 2.0F);
  for (std::size_t i = 0; i < aimed_at_.size(); ++i) {
    const std::array<float, 4>& n = source_.normals[aimed_at_[i]];
    const FourInts number = FourInts{} + static_cast<std::int32_t>(i);
    for (std::size_t half = 0; half < 2; ++half) {
      const Four h = axes[half][0].all() * n[0] + axes[half][1].all() * n[1] + axes[half][2].all() * n[2];
      at_highest[half] = h > highest[half] ? number : at_highest[half];
      highest[half] = greatest(highest[half], h);
      at_lowest[half] = h < lowest[half] ? number : at_lowest[half];
      lowest[half] = least(lowest[half], h);
    }
  }
  std::vector<std::uint32_t> kept;
  kept.reserve(2 * kAxes + 1);
  for (std::size_t k = 0; k < kAxes; ++k) kept.push_back(aimed_at_[static_cast<std::size_t>(at_highest[k / 4][k % 4])]);
  for (std::size_t k = 0; k < kAxes; ++k) kept.push_back(aimed_at_[static_cast<std::size_t>(at_lowest[k / 4][k % 4])]);
  kept.push_back(aimed_at_[static_cast<std::size_t>(at_highest[1][2])]);
  return kept;
}

Direction SlabReducer::find_aim() {
  normals_.clear();
  aimed_at_.clear();
  Vec3d mean;
  // Of very many a choice will do: the direction is only a proposal.
  constexpr std::size_t kEnough = 1500;
  std::size_t all = 0, at = 0;
  for (const Entry e : union_) all += e.is_block() ? kBlock : 1;
  const std::size_t stride = 1 + all / kEnough;
  for_triangles(union_, [&](std::uint32_t t) {
    if (at++ % stride != 0) return;
    aimed_at_.push_back(t);
    mean += source_.normal(t);
  });
  mean = normalized(mean);
  if (aimed_at_.size() > 14) aimed_at_ = outermost(mean);
  for (const std::uint32_t t : aimed_at_) normals_.push_back(source_.normal(t));
  Direction best = best_direction(normals_);
  if (best.visibility > 0.05) return best;
  // The normals fit in no cap below a half sphere: blend the worst one in, again and again.
  Vec3d d = mean;
  for (int k = 0; k < 50; ++k) {
    Vec3d worst = d;
    double least = 2;
    for (const Vec3d n : normals_)
      if (const double h = dot(n, d); h < least) {
        least = h;
        worst = n;
      }
    if (least > best.visibility) best = {d, least};
    d = normalized(d * (1 - 1.0 / (k + 2)) + worst * (1.0 / (k + 2)));
  }
  return best;
}

SlabReducer::Quality SlabReducer::quality(Vec3d at) const noexcept {
  Quality q;
  for (std::size_t k = trial_.fresh; k < trial_.faces.size(); ++k) {
    const Face& f = trial_.faces[k];
    const Vec3d b = cage_.at[f[1]], c = cage_.at[f[2]];
    const double shape = shape_of(at, b, c, length(cross(b - at, c - at)));
    q.least = std::min(q.least, shape);
    q.mean += shape / double(trial_.faces.size());
  }
  return q;
}

SlabReducer::Quality SlabReducer::quality_now() const noexcept {
  Quality q;
  for (const std::uint32_t s : trial_.slots) {
    const Face& f = cage_.faces[s];
    const double shape = shape_of(cage_.at[f[0]], cage_.at[f[1]], cage_.at[f[2]],
                                  length(cross(cage_.at[f[1]] - cage_.at[f[0]], cage_.at[f[2]] - cage_.at[f[0]])));
    q.least = std::min(q.least, shape);
    q.mean += shape / double(trial_.slots.size());
  }
  return q;
}

/// All tests of a trial, cheap ones first. Leaves the shapes and lists of the new slabs behind.
SlabReducer::Fault SlabReducer::evaluate() {
  lost_ = 0;
  const auto end = [&](std::uint32_t v, Side side) {
    return v == trial_.moved ? trial_.ends[side] : cage_.ends[v][side];
  };
  if (trial_.moved != kNone) {
    // C2: the link, seen along the fibre, comes round once.
    const LatticePoint centre = trial_.ends[kInner], d = trial_.ends[kOuter] - centre;
    const LatticePoint start = cage_.ends[trial_.faces[0][1]][kInner] - centre;
    int turns = 0, last = 0;
    for (std::size_t k = 1; k <= trial_.faces.size(); ++k) {
      const int sign =
          k == trial_.faces.size() ? 0 : determinant_sign(d, start, cage_.ends[trial_.faces[k][1]][kInner] - centre);
      turns += last < 0 && sign >= 0;
      last = sign;
    }
    if (turns != 1) return Fault::Winding;
  }
  trial_.triangles.clear();
  for (std::size_t k = trial_.fresh; k < trial_.faces.size(); ++k) {
    const Face& f = trial_.faces[k];
    const auto& [in, out] = trial_.triangles.emplace_back(
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
  trial_.shapes.clear();
  for (const auto& [in, out] : trial_.triangles) trial_.shapes.emplace_back(in, out);
  gather();
  // What failed last is likely to fail again; slabs near a star are few, its source may be much.
  if (const Fault fault = evaluate_hint(); fault != Fault::None) return fault;
  if (const Fault fault = evaluate_overlap(); fault != Fault::None) return fault;
  return evaluate_source();
}

SlabReducer::Fault SlabReducer::fault_of(Meeting m) noexcept {
  return m == Meeting::Outer    ? Fault::Outer
         : m == Meeting::Inner  ? Fault::Inner
         : m == Meeting::Folded ? Fault::Folded
                                : Fault::None;
}

/// The fault of a piece that is in a slab, if there is one: folds, and what may be lost, are let go as long as there is
/// area to spare.
SlabReducer::Fault SlabReducer::judge(Meeting m, std::uint32_t triangle, double& spare) {
  if (m == Meeting::Folded && folds_at_will()) return Fault::None;
  if (spare_ && (m == Meeting::Outer || m == Meeting::Inner)) {
    lost_ += 0.25 * length(source_.cross_of(triangle));  // about half of it is outside
    return lost_ <= *spare_ ? Fault::None : Fault::Lost;
  }
  if (m == Meeting::Folded && spare > 0) {
    spare -= 0.5 * length(source_.cross_of(triangle));
    if (spare >= 0) return Fault::None;
  }
  return fault_of(m);
}

/// Lists the triangles of a block that do not fit as a whole.
SlabReducer::Fault SlabReducer::evaluate_block(const SlabShape& s, const QuickShape& quick, std::size_t piece,
                                               bool is_within, double& spare) {
  const std::uint32_t first = union_[piece].first();
  const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(kBlock, source_.faces.size() - first));
  if (spread_[piece] == kNone) {
    spread_[piece] = spread_count_++;
    if (spread_blocks_.size() < spread_count_) spread_blocks_.emplace_back();
    auto& fours = spread_blocks_[spread_[piece]];
    for (std::uint32_t k = 0; k < count; k += 4)
      source_.set_four(fours[k / 4], std::min<std::size_t>(4, count - k), origin_,
                       [&](std::size_t lane) { return first + k + static_cast<std::uint32_t>(lane); });
  }
  const auto& fours = spread_blocks_[spread_[piece]];
  for (std::uint32_t k = 0; k < count; k += 4) {
    const QuickShape::Verdict verdict =
        is_within ? QuickShape::Verdict{(1U << std::min(4U, count - k)) - 1, quick.crossed(fours[k / 4])}
                  : quick.meet(fours[k / 4]);
    for (unsigned left = verdict.near; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint32_t t = first + k + lane;
      if ((verdict.section >> lane & 1U) == 0) {
        const Meeting m = s.meet(source_.triangle(t));
        if (m == Meeting::Apart) continue;
        if (const Fault fault = judge(m, t, spare); fault != Fault::None) {
          hint_ = t;
          return fault;
        }
      }
      trial_.lists.push_back(Entry::triangle(t));
    }
  }
  return Fault::None;
}

/// C5 and C6 of the triangle that failed last.
SlabReducer::Fault SlabReducer::evaluate_hint() {
  if (hint_ == kNone || tolerance_.folds > 0) return Fault::None;
  const SourceTriangle t = source_.triangle(hint_);
  for (std::size_t k = 0; k < trial_.shapes.size(); ++k)
    if (const Fault fault = fault_of(trial_.shapes[k].meet(t)); fault != Fault::None) {
      failed_ = k;
      return fault;
    }
  return Fault::None;
}

// C5 and C6.
SlabReducer::Fault SlabReducer::evaluate_source() {
  lay_out();
  if (spare_) met_.assign(union_.size(), 0);
  trial_.lists.clear();
  trial_.ranges.resize(trial_.shapes.size());
  // Where the last trial failed this one is likely to, too.
  for (std::size_t step = 0; step < trial_.shapes.size(); ++step) {
    const std::size_t at = step == 0 ? failed_ : step <= failed_ ? step - 1 : step;
    const SlabShape& s = trial_.shapes[at];
    const auto fail = [&](Fault fault) {
      failed_ = at;
      return fault;
    };
    const auto begin = static_cast<std::uint32_t>(trial_.lists.size());
    const QuickShape quick(s, origin_);
    double spare = tolerance_.folds * s.middle_area();
    for (std::size_t four = 0; four < pieces_.size(); ++four) {
      const QuickShape::Verdict verdict = quick.meet(pieces_[four]);
      for (unsigned left = verdict.near; left != 0; left &= left - 1) {
        const std::size_t k = 4 * four + static_cast<std::size_t>(std::countr_zero(left));
        const Entry e = union_[k];
        if (e.is_block()) {
          const Meeting whole = s.meet(source_.blocks[e.first() / kBlock]);
          if (whole == Meeting::Section) trial_.lists.push_back(e);
          if (whole == Meeting::Section || whole == Meeting::Apart) continue;
          const Fault fault = evaluate_block(s, quick, k, whole == Meeting::Within, spare);
          if (fault != Fault::None) return fail(fault);
          continue;
        }
        if ((verdict.section >> (k % 4) & 1U) == 0) {
          const Meeting m = s.meet(source_.triangle(e.first()));
          if (m == Meeting::Apart) continue;
          if (const Fault fault = judge(m, e.first(), spare); fault != Fault::None) {
            hint_ = e.first();
            return fail(fault);
          }
        }
        if (spare_) met_[k] = 1;
        trial_.lists.push_back(e);
      }
    }
    // Triangles that make up half a block or more are listed as the block.
    std::size_t kept = begin;
    for (std::size_t k = begin; k < trial_.lists.size();) {
      std::size_t stop = k + 1;
      const Entry e = trial_.lists[k];
      if (!e.is_block()) {
        while (stop < trial_.lists.size() && !trial_.lists[stop].is_block() &&
               trial_.lists[stop].first() / kBlock == e.first() / kBlock)
          ++stop;
      }
      if (stop - k >= kBlock / 2 && tolerance_.loss == 0)
        trial_.lists[kept++] = Entry::block(e.first() / kBlock);
      else
        for (std::size_t j = k; j < stop; ++j) trial_.lists[kept++] = trial_.lists[j];
      k = stop;
    }
    trial_.lists.resize(kept);
    if (kept == begin) return fail(Fault::Empty);
    trial_.ranges[at] = {begin, static_cast<std::uint32_t>(kept - begin)};
  }
  for (std::size_t k = 0; spare_ && k < met_.size(); ++k)
    if (met_[k] == 0) lost_ += areas_[k];
  return spare_ && lost_ > *spare_ ? Fault::Lost : Fault::None;
}

// C3, inner against outer included.
SlabReducer::Fault SlabReducer::evaluate_overlap() {
  const std::size_t count = trial_.shapes.size();
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) {
      const SlabShape &s = trial_.shapes[a], &t = trial_.shapes[b];
      if (!s.box(kInner).meets(t.box(kOuter)) || s.surely_apart(kInner, t, kOuter)) continue;
      if (triangles_meet(s.triangle(kInner), t.triangle(kOuter))) return Fault::InnerOverlap;
    }
  Box3d all;
  for (const SlabShape& s : trial_.shapes) all.add(s.box());
  const FloatBox bounds = FloatBox::around(all);
  const BoxProbe probe(bounds);
  const std::uint32_t part = cage_.part_of(trial_.slots[trial_.fresh]);
  Fault fault = Fault::None;
  trial_.fours.assign((count + 3) / 4, {});
  for (std::size_t k = 0; k < count; ++k)
    trial_.fours[k / 4].set(k % 4, trial_.faces[trial_.fresh + k], trial_.shapes[k]);
  boxes_->query(all, [&](std::uint32_t place) {
    const std::uint32_t g = boxed_[place];
    if (in_star_[g] == star_round_) return true;
    const SideBoxes theirs = boxes_of(g);
    const std::array<bool, 2> is_near = {probe.meets(theirs[kInner]), probe.meets(theirs[kOuter])};
    if (!is_near[kInner] && !is_near[kOuter]) return true;
    if (cage_.part_of(g) != part) {
      // C4: a part that is small beside a slab must not be swallowed whole.
      for (std::size_t k = 0; k < count; ++k)
        if (in_hull(trial_.shapes[k].triangle(kInner), trial_.shapes[k].triangle(kOuter),
                    cage_.ends[cage_.faces[g][0]][kOuter])) {
          fault = Fault::OuterOverlap;
          return false;
        }
    }
    for (std::size_t four = 0; four < trial_.fours.size(); ++four) {
      const unsigned joined = trial_.fours[four].joined_to(cage_.faces[g]);
      for (const Side mine : {kOuter, kInner})
        for (const Side side : {kOuter, kInner}) {
          if (!is_near[side]) continue;
          unsigned left = trial_.fours[four].boxes[mine].meeting(theirs[side]);
          if (mine == side) left &= ~joined;
          for (; left != 0; left &= left - 1) {
            const SlabShape& shape = trial_.shapes[4 * four + static_cast<std::size_t>(std::countr_zero(left))];
            const LatticeTriangle other = cage_.triangle(g, side);
            if (shape.surely_apart(mine, other) || !triangles_meet(shape.triangle(mine), other)) continue;
            fault = mine == kOuter ? Fault::OuterOverlap : Fault::InnerOverlap;
            return false;
          }
        }
    }
    return true;
  });
  return fault;
}

/// Gives the trial's lists and boxes to its faces.
void SlabReducer::commit_lists() {
  for (const std::uint32_t f : trial_.vanished) {
    listed_ -= cage_.lists[f].count;
    cage_.lists[f] = {};
    boxes_->set(place_of_[f], {});
  }
  for (std::size_t k = 0; k < trial_.shapes.size(); ++k) {
    const std::uint32_t f = trial_.slots[trial_.fresh + k];
    List& list = cage_.lists[f];
    listed_ -= list.count;
    list = {static_cast<std::uint32_t>(cage_.pool.size()), trial_.ranges[k].count};
    listed_ += list.count;
    cage_.pool.insert(cage_.pool.end(), trial_.lists.begin() + trial_.ranges[k].begin,
                      trial_.lists.begin() + trial_.ranges[k].begin + trial_.ranges[k].count);
    boxes_->set(place_of_[f], trial_.shapes[k].box());
  }
  gathered_ = false;
  if (cage_.pool.size() > most_listed()) pack_lists();
  if (9 * alive_ < 5 * boxed_.size()) build_boxes();
}

/// Leaves out what is in no list any more.
void SlabReducer::pack_lists() {
  std::vector<std::uint32_t> order;  // of faces with lists, as these lie in memory
  order.reserve(alive_);
  for (std::uint32_t f = 0; f < cage_.lists.size(); ++f) {
    if (cage_.lists[f].count > 0)
      order.push_back(f);
    else
      cage_.lists[f] = {};
  }
  std::ranges::sort(order, {}, [&](std::uint32_t f) { return cage_.lists[f].begin; });
  auto end = cage_.pool.begin();
  for (const std::uint32_t f : order) {
    List& list = cage_.lists[f];
    const auto from = cage_.pool.begin() + list.begin;
    list.begin = static_cast<std::uint32_t>(end - cage_.pool.begin());
    end = from == end ? from + list.count : std::copy(from, from + list.count, end);
  }
  cage_.pool.erase(end, cage_.pool.end());
}

bool SlabReducer::try_ends(Vec3d at, const Ends& ends) {
  if (length(to_double(ends[kOuter] - ends[kInner])) > longest_) return false;
  if (const double lost = lost_now(); lost > 0) spare_ = lost;
  trial_.ends = ends;
  const Fault fault = evaluate();
  spare_.reset();
  if (fault != Fault::None) return false;
  cage_.at[trial_.moved] = at;
  cage_.ends[trial_.moved] = ends;
  commit_lists();
  touch(trial_.moved);
  return true;
}

/// How much of the source is outside the slabs of the star in hand.
double SlabReducer::lost_now() {
  if (tolerance_.loss == 0) return 0;
  gather();
  if (!lost_before_) {
    trial_.ends = cage_.ends[trial_.moved];
    spare_ = Box3d::kFar;
    evaluate();
    spare_.reset();
    lost_before_ = lost_;
  }
  return *lost_before_;
}

// While slabs are about as small as the source's triangles, one end can mostly be merged into the other as it is, which
// changes half as many slabs. Where one way round is too dear or makes slabs too thin the other is tried; what
// evaluate() refuses is left to a whole collapse.
bool SlabReducer::drop_end(std::uint32_t h, double most) {
  constexpr double kDearer = 4;    // half the work is worth a place that is not quite the best
  constexpr double kShape = 0.15;  // of a slab that changes, at least
  Quadric q = cage_.quadrics[origin(h)];
  q += cage_.quadrics[target(h)];
  const Vec3d edge = cage_.at[target(h)] - cage_.at[origin(h)];
  struct Way {
    std::uint32_t h;
    double cost;
  };
  const auto way_of = [&](std::uint32_t e) { return Way{e, merge_cost(q, cage_.at[origin(e)], dot(edge, edge))}; };
  std::array<Way, 2> ways = {way_of(h), way_of(twins_[h])};
  if (std::min(ways[0].cost, ways[1].cost) > kDearer * most || !link_allows(h)) return false;
  // First the end that has fewer slabs around it goes: they are what has to be judged anew.
  const int more = valences_[target(h)] - valences_[origin(h)];
  if (more > 0 || (more == 0 && ways[1].cost < ways[0].cost)) std::swap(ways[0], ways[1]);
  for (const auto& [way, cost] : ways) {
    if (cost > kDearer * most || !star_of_edge(way)) continue;
    trial_.fresh = trial_.second;
    if (trial_.fresh == trial_.faces.size() || quality(cage_.at[origin(way)]).least < kShape) continue;
    trial_.ends = cage_.ends[origin(way)];
    if (evaluate() != Fault::None) return false;
    merge(way, cage_.at[origin(way)]);
    return true;
  }
  return false;
}

bool SlabReducer::collapse(std::uint32_t h) {
  if (!link_allows(h)) return false;
  if (collapse_somewhere(h)) return true;
  if (tolerance_.loss == 0) return false;
  may_lose_ = true;
  const bool done = collapse_somewhere(h);
  may_lose_ = false;
  spare_.reset();
  return done;
}

bool SlabReducer::collapse_somewhere(std::uint32_t h) {
  if (!star_of_edge(h)) return false;
  const std::uint32_t u = origin(h), v = target(h);
  const Vec3d best = weigh(u, v).place;
  double before = quality_now().least;
  for (const std::uint32_t f : trial_.vanished) {
    const Face& g = cage_.faces[f];
    before =
        std::min(before, shape_of(cage_.at[g[0]], cage_.at[g[1]], cage_.at[g[2]],
                                  length(cross(cage_.at[g[1]] - cage_.at[g[0]], cage_.at[g[2]] - cage_.at[g[0]]))));
  }
  for (const Vec3d at : {best, cage_.at[u], cage_.at[v], (cage_.at[u] + cage_.at[v]) * 0.5})
    if (collapse_to(h, at, before)) return true;
  if (!thorough_) return false;
  gather();
  // Where the source may fold as it likes, a bad shape is no reason to keep a slab.
  const double least = folds_at_will() ? 0 : before;
  for (const Vec3d start : {best, (cage_.at[u] + cage_.at[v]) * 0.5})
    if (collapse_to(h, seeing_place(start), least)) return true;
  return false;
}

/// The direction that best sees the triangles between a place and the ends around it, of both sides: a fibre there
/// must have such a direction, whatever the source is like.
Direction SlabReducer::star_direction(Vec3d at) const {
  std::vector<Vec3d> normals;
  for_rim([&](Side, Vec3d b, Vec3d c) {
    const Vec3d n = cross(b - at, c - at);
    if (const double size = length(n); size > 0) normals.push_back(n / size);
  });
  return best_direction(normals);
}

/// A place where star_direction() sees as much as can be found: by turns the best direction for a place, and the best
/// place for a direction.
Vec3d SlabReducer::seeing_place(Vec3d start) const {
  constexpr int kTurns = 4;
  Vec3d sum;  // across the rings of both sides
  for_rim([&](Side, Vec3d b, Vec3d c) { sum += cross(b - start, c - start); });
  if (!(length(sum) > 0)) return start;
  Vec3d at = start, best = start, d = normalized(sum);
  double most = star_direction(start).visibility;
  for (int turn = 0; turn < kTurns; ++turn) {
    at = innermost(at, d);
    const Direction there = star_direction(at);
    if (there.visibility > most) {
      most = there.visibility;
      best = at;
    }
    d = there.d;
  }
  return best;
}

/// The place that, seen along d, lies as far as possible to the left of all edges of the rings around a star: steps
/// away from the edge that is nearest, each shorter than the last.
Vec3d SlabReducer::innermost(Vec3d start, Vec3d d) const {
  constexpr int kSteps = 60;
  struct Line {
    Vec3d from, left;
  };
  std::vector<Line> lines;
  double size = 0;
  for_rim([&](Side, Vec3d b, Vec3d c) {
    const Vec3d left = cross(d, c - b);
    if (const double across = length(left); across > 0) lines.push_back({b, left / across});
    size = std::max(size, length(b - start));
  });
  Vec3d at = start, best = start;
  double most = -Box3d::kFar;
  for (int step = 0; step < kSteps && !lines.empty(); ++step) {
    double least = Box3d::kFar;
    Vec3d away;
    for (const Line& line : lines)
      if (const double distance = dot(at - line.from, line.left); distance < least) {
        least = distance;
        away = line.left;
      }
    if (least > most) {
      most = least;
      best = at;
    }
    at += away * (0.5 * size / (step + 2));
  }
  return best;
}

// On a rough source merged fibres must grow nearly each time: then they start higher, so that fewer starts are in vain.
void SlabReducer::adapt_growth(Fault fault) {
  constexpr double kUp = 1.1, kDown = 0.97, kMost = 1.5;
  if (fault == Fault::Outer || fault == Fault::Inner) {
    double& growth = growth_[fault == Fault::Outer ? kOuter : kInner];
    growth = std::min(kMost, growth * kUp);
  } else {
    for (double& growth : growth_) growth = std::max(1.0, growth * kDown);
  }
}

/// How far a new fibre through `at` along the unit vector d may reach to each side so that the Jacobian can be positive
/// at both ends of the slabs around it; nothing where it is not at any height. A filter: rounded, and not all of C1.
std::optional<std::array<SlabReducer::Range, 2>> SlabReducer::heights_along(Vec3d at, Vec3d d) const noexcept {
  std::array<Range, 2> heights;
  for (std::size_t k = trial_.fresh; k < trial_.faces.size(); ++k) {
    const Face& f = trial_.faces[k];
    const std::array<Vec3d, 2> fibres = {to_double(cage_.ends[f[1]][kOuter] - cage_.ends[f[1]][kInner]),
                                         to_double(cage_.ends[f[2]][kOuter] - cage_.ends[f[2]][kInner])};
    for (const Side side : {kInner, kOuter}) {
      const Vec3d b = to_double(cage_.ends[f[1]][side]) - at, c = to_double(cage_.ends[f[2]][side]) - at;
      // The triangle from the fibre's end, at the height h, to b and c has the normal n - h turn.
      const Vec3d n = cross(b, c), turn = cross(b - c, d) * (side == kOuter ? 1.0 : -1.0);
      if (!(dot(n, d) > 0)) return std::nullopt;
      for (const Vec3d fibre : fibres) {
        const double upright = dot(n, fibre), per_height = dot(turn, fibre);
        if (per_height > 0) {
          heights[side].most = std::min(heights[side].most, upright / per_height);
        } else if (per_height < 0) {
          heights[side].least = std::max(heights[side].least, upright / per_height);
        } else if (upright <= 0) {
          return std::nullopt;
        }
      }
      if (!(heights[side].least < heights[side].most)) return std::nullopt;
    }
  }
  return heights;
}

bool SlabReducer::collapse_to(std::uint32_t h, Vec3d at, double shape_before) {
  const double shape = quality(at).least;
  if (shape < 0.08 && shape < 0.9 * shape_before) return false;
  gather();
  const std::uint32_t u = origin(h), v = target(h);
  const std::array<Vec3d, 2> old = {to_double(cage_.ends[u][kOuter] - cage_.ends[u][kInner]),
                                    to_double(cage_.ends[v][kOuter] - cage_.ends[v][kInner])};
  const double thickness = (length(old[0]) + length(old[1])) * 0.5;
  const std::array<Vec3d, 5> choices = {aim().d, normalized(normalized(old[0]) + normalized(old[1])),
                                        normalized(old[0]), normalized(old[1]),
                                        thorough_ ? star_direction(at).d : Vec3d{}};
  const auto directions = std::span(choices).first(thorough_ ? 5 : 4);
  std::size_t choice = 0;
  std::array<double, 2> heights{};
  std::array<Range, 2> room{};
  // Begins with the next direction that leaves the fibre some height. False when there is none.
  const auto start = [&] {
    spare_.reset();
    for (; choice < directions.size(); ++choice) {
      const Vec3d d = directions[choice];
      const auto found = heights_along(at, d);
      if (!found) continue;
      room = *found;
      for (const Side side : {kInner, kOuter}) {
        const double sign = side == kOuter ? 1 : -1;
        const double mean =
            0.5 * sign * (dot(to_double(cage_.ends[u][side]) - at, d) + dot(to_double(cage_.ends[v][side]) - at, d));
        heights[side] = room[side].nearest(std::max(mean, 0.25 * thickness) * growth_[side]);
      }
      return true;
    }
    return false;
  };
  const auto end_at = [&](Side side, double height) {
    return snap(at + directions[choice] * (side == kOuter ? height : -height));
  };
  // Whether the triangle that met a side of a slab would not if the fibre were of this height there.
  const auto is_cleared = [&](Side side, double height) {
    SideTriangles slab = trial_.triangles[failed_];
    slab[side][0] = end_at(side, height);
    const Meeting m = SlabShape(slab[kInner], slab[kOuter]).meet(source_.triangle(hint_));
    return m != (side == kOuter ? Meeting::Outer : Meeting::Inner);
  };
  const auto grow = [&](Side side) {
    const double before = heights[side];
    heights[side] = std::min(1.35 * before + 0.1 * thickness, 0.5 * (before + room[side].most));
    return heights[side] > 1.02 * before;
  };
  const auto grow_clear = [&](Side side) {
    if (!is_cleared(side, std::min(room[side].most, longest_))) return false;
    while (grow(side))
      if (is_cleared(side, heights[side])) return true;
    return false;
  };
  const auto shrink = [&](Side side, double share) {
    const double before = heights[side];
    heights[side] = std::max(share * before, 0.5 * (before + room[side].least));
    return heights[side] < 0.98 * before;
  };
  // Where it would have to grow and cannot.
  const auto give_up_some = [&] {
    if (!may_lose_ || spare_) return false;
    spare_ = tolerance_.loss * area_;
    return true;
  };
  if (!start()) return false;
  int shrunk = 0;
  const bool patient = alive_ <= few_;  // each slab is worth more tries
  for (int attempt = 0; attempt < (patient ? 24 : 10); ++attempt) {
    const double sum = heights[0] + heights[1];
    if (sum > 0.999 * longest_) {
      if (attempt > 0) return false;
      for (double& height : heights) height *= 0.999 * longest_ / sum;
    }
    trial_.ends = {end_at(kInner, heights[kInner]), end_at(kOuter, heights[kOuter])};
    const Fault fault = evaluate();
    if (attempt == 0) adapt_growth(fault);
    bool goes_on = true;  // along this direction
    switch (fault) {
      case Fault::None:
        merge(h, at);
        return true;
      case Fault::Jacobian:
        goes_on = ++shrunk <= 3;
        if (goes_on)
          for (const Side side : {kInner, kOuter}) shrink(side, 0.6);
        break;
      case Fault::Outer:
      case Fault::Inner: {
        const std::array<double, 2> before = heights;
        goes_on = grow_clear(fault == Fault::Outer ? kOuter : kInner);
        if (goes_on || !give_up_some()) break;
        goes_on = true;
        heights = before;
        break;
      }
      case Fault::Empty:
        goes_on = grow(kOuter);
        break;
      case Fault::OuterOverlap:
        goes_on = shrink(kOuter, 0.8);
        break;
      case Fault::InnerOverlap:
        goes_on = shrink(kInner, 0.8);
        break;
      case Fault::Outside:
        return false;
      case Fault::Winding:  // at no height
      case Fault::Folded:
      case Fault::Lost:
        goes_on = false;
        break;
    }
    if (goes_on) continue;
    if (!patient && fault != Fault::Folded) return false;
    ++choice;
    if (!start()) return false;
    shrunk = 0;
  }
  return false;
}

void SlabReducer::merge(std::uint32_t h, Vec3d at) {
  const std::uint32_t u = origin(h), v = target(h), back = twins_[h];
  const std::uint32_t a = target(next_of(h)), b = target(next_of(back));
  const std::uint32_t a_to_v = twins_[next_of(h)], u_to_a = twins_[last_of(h)];
  const std::uint32_t b_to_u = twins_[next_of(back)], v_to_b = twins_[last_of(back)];
  for (const std::uint32_t f : trial_.slots)
    for (std::uint32_t& w : cage_.faces[f])
      if (w == v) w = u;
  for (const std::uint32_t f : trial_.vanished) cage_.faces[f] = {kNone, kNone, kNone};
  twins_[a_to_v] = u_to_a;
  twins_[u_to_a] = a_to_v;
  twins_[b_to_u] = v_to_b;
  twins_[v_to_b] = b_to_u;
  out_[u] = u_to_a;
  out_[a] = a_to_v;
  out_[b] = b_to_u;
  out_[v] = kNone;
  valences_[u] = static_cast<std::uint16_t>(valences_[u] + valences_[v] - 4);
  --valences_[a];
  --valences_[b];
  cage_.quadrics[u] += cage_.quadrics[v];
  cage_.at[u] = at;
  cage_.ends[u] = trial_.ends;
  ++stamps_[u];
  ++stamps_[v];
  alive_ -= 2;
  commit_lists();
  touch(u);
  if (!queued_) return;
  for_ring(u, [&](std::uint32_t e) {
    push(e);
    std::push_heap(queue_.begin(), queue_.end());
  });
}

// Turns, slides and shortens a fibre where that makes further collapses likelier.
void SlabReducer::improve(std::uint32_t v) {
  star_of(v);
  gather();
  const auto fibre = [&] { return to_double(cage_.ends[v][kOuter] - cage_.ends[v][kInner]); };
  const auto shifted = [](LatticePoint p, Vec3d by) { return snap(to_double(p) + by); };
  {
    const Direction best = aim();
    const Vec3d d = normalized(fibre());
    if (best.visibility > least_lean(d) + 0.01) {
      const double in = dot(cage_.at[v] - to_double(cage_.ends[v][kInner]), d),
                   out = dot(to_double(cage_.ends[v][kOuter]) - cage_.at[v], d);
      for (const double share : {1.0, 0.5, 0.25}) {
        const Vec3d turned = normalized(d * (1 - share) + best.d * share);
        if (try_ends(cage_.at[v], {snap(cage_.at[v] - turned * in), snap(cage_.at[v] + turned * out)})) break;
      }
    }
  }
  {
    Vec3d mean;
    for (const Face& f : trial_.faces) mean += cage_.at[f[1]] / double(trial_.faces.size());
    const Vec3d d = normalized(fibre());
    Vec3d step = mean - cage_.at[v];
    step = step - d * dot(step, d);
    const Quality before = quality_now();
    for (const double share : {0.6, 0.3}) {
      const Quality after = quality(cage_.at[v] + step * share);
      if (after.least + 0.3 * after.mean < before.least + 0.3 * before.mean + 0.01) continue;
      const Vec3d by = step * share;
      if (try_ends(cage_.at[v] + by, {shifted(cage_.ends[v][kInner], by), shifted(cage_.ends[v][kOuter], by)})) break;
    }
  }
  if (length(fibre()) > 1e-3 * longest_) {
    const auto shortened = [&](Side side) {
      return shifted(cage_.ends[v][side], (cage_.at[v] - to_double(cage_.ends[v][side])) * 0.4);
    };
    const LatticePoint in = shortened(kInner), out = shortened(kOuter);
    if (!try_ends(cage_.at[v], {in, out}) && !try_ends(cage_.at[v], {cage_.ends[v][kInner], out}))
      try_ends(cage_.at[v], {in, cage_.ends[v][kOuter]});
  }
}

/// Moves and turns a fibre so that the triangles around it are seen better: that leaves more room for others.
void SlabReducer::settle(std::uint32_t v) {
  constexpr double kGain = 0.01;
  star_of(v);
  gather();
  const Vec3d now = cage_.at[v], in = to_double(cage_.ends[v][kInner]), out = to_double(cage_.ends[v][kOuter]);
  const Vec3d d = normalized(out - in);
  const double depth = dot(now - in, d), height = dot(out - now, d);
  double least = 1;
  for_rim([&](Side, Vec3d b, Vec3d c) {
    const Vec3d n = cross(b - now, c - now);
    if (const double size = length(n); size > 0) least = std::min(least, dot(n, d) / size);
  });
  const Vec3d step = seeing_place(now) - now;
  for (const double share : {1.0, 0.5, 0.25}) {
    const Vec3d at = now + step * share;
    const Direction there = star_direction(at);
    if (there.visibility < least + kGain) continue;
    if (try_ends(at, {snap(at - there.d * depth), snap(at + there.d * height)})) return;
    if (try_ends(at, {snap(in + step * share), snap(out + step * share)})) return;
  }
  const Direction seen = star_direction(now);
  if (seen.visibility < least + kGain) return;
  for (const double share : {1.0, 0.5, 0.25}) {
    const Vec3d turned = normalized(d * (1 - share) + seen.d * share);
    if (try_ends(now, {snap(now - turned * depth), snap(now + turned * height)})) return;
  }
}

/// Moves a fibre's ends to the middle of those around it, as far as that goes: ends on even surfaces merge best.
void SlabReducer::even_out(std::uint32_t v) {
  star_of(v);
  gather();
  std::array<Vec3d, 2> middle;
  for_rim([&](Side side, Vec3d b, Vec3d) { middle[side] += b / double(trial_.faces.size()); });
  const Vec3d now = cage_.at[v];
  const Ends old = cage_.ends[v];
  for (const double share : {1.0, 0.5, 0.2}) {
    Ends moved = old;
    Vec3d by;
    for (const Side side : {kInner, kOuter}) {
      const Vec3d step = (middle[side] - to_double(old[side])) * share;
      moved[side] = snap(to_double(old[side]) + step);
      by += step * 0.5;
    }
    if (try_ends(now + by, moved)) return;
    if (try_ends(now, {old[kInner], moved[kOuter]}) || try_ends(now, {moved[kInner], old[kOuter]})) return;
  }
}

void SlabReducer::flip(std::uint32_t h) {
  const std::uint32_t back = twins_[h];
  const std::uint32_t u = origin(h), v = target(h), a = target(next_of(h)), b = target(next_of(back));
  const auto shape = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    return shape_of(cage_.at[i], cage_.at[j], cage_.at[k],
                    length(cross(cage_.at[j] - cage_.at[i], cage_.at[k] - cage_.at[i])));
  };
  const double before = std::min(shape(u, v, a), shape(v, u, b)), after = std::min(shape(u, b, a), shape(b, v, a));
  const std::array<std::size_t, 4> degree = {valences_[u], valences_[v], valences_[a], valences_[b]};
  if (degree[0] < 4 || degree[1] < 4 || degree[2] > 11 || degree[3] > 11) return;
  const auto off = [](std::size_t d) { return std::abs(static_cast<int>(d) - 6); };
  const int gain = off(degree[0]) + off(degree[1]) + off(degree[2]) + off(degree[3]) - off(degree[0] - 1) -
                   off(degree[1] - 1) - off(degree[2] + 1) - off(degree[3] + 1);
  if (!(after > 1.05 * before + 0.02 || (gain >= 2 && after > 0.5 * before && after > 0.2))) return;
  bool joined = false;
  for_ring(a, [&](std::uint32_t e) { joined = joined || target(e) == b; });
  if (joined) return;
  const std::uint32_t f = h / 3, g = back / 3;
  trial_.faces = {{u, b, a}, {b, v, a}};
  trial_.slots = {f, g};
  trial_.vanished.clear();
  trial_.fresh = 0;
  trial_.moved = kNone;
  gathered_ = false;
  if (evaluate() != Fault::None) return;
  const std::uint32_t a_to_v = twins_[next_of(h)], u_to_a = twins_[last_of(h)];
  const std::uint32_t b_to_u = twins_[next_of(back)], v_to_b = twins_[last_of(back)];
  cage_.faces[f] = trial_.faces[0];
  cage_.faces[g] = trial_.faces[1];
  const auto join = [&](std::uint32_t x, std::uint32_t y) {
    twins_[x] = y;
    twins_[y] = x;
    tried_[x] = tried_[y] = 0;
  };
  join(3 * f, b_to_u);
  join(3 * f + 1, 3 * g + 2);
  join(3 * f + 2, u_to_a);
  join(3 * g, v_to_b);
  join(3 * g + 1, a_to_v);
  --valences_[u];
  --valences_[v];
  ++valences_[a];
  ++valences_[b];
  out_[u] = 3 * f;
  out_[b] = 3 * g;
  out_[v] = 3 * g + 1;
  out_[a] = 3 * f + 2;
  commit_lists();
  for (const std::uint32_t w : {u, v, a, b}) touch(w);
}

// While there are many slabs, edges below a rising cost are collapsed in the order in which they lie in memory: the
// order by cost matters little there, and what is touched stays in the cache. A vertex that has taken up another rests
// until the next sweep, unless the edge was come to from the other's side.
bool SlabReducer::sweep(std::size_t stop, const Progress& progress) {
  constexpr double kShare = 0.35;  // of the edges may be tried in a sweep
  constexpr std::size_t kStride = 7;
  if (!boxes_) build_boxes();
  swept_to_ = stop;
  std::vector<double> costs;
  swept_.assign(out_.size(), 0);
  const double start = double(alive_);
  const std::size_t fixed = alive_ - free_;
  for (std::uint32_t round = 1; alive_ > stop; ++round) {
    if (progress.cancelled()) return false;
    costs.clear();
    std::size_t counter = 0;
    for (std::uint32_t h = 0; h < twins_.size(); ++h)
      if (is_free_edge(h) && ++counter % kStride == 0) costs.push_back(weigh(origin(h), target(h)).cost);
    if (costs.empty()) break;
    const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(kShare * double(costs.size()));
    std::nth_element(costs.begin(), middle, costs.end());
    const double most = *middle;
    const std::size_t before = alive_;
    for (std::uint32_t h = 0; h < twins_.size() && alive_ > stop; ++h) {
      if (!is_free_edge(h)) continue;
      const std::uint32_t u = origin(h), v = target(h);
      if (swept_[u] == round || swept_[v] == round || std::max(touched_[u], touched_[v]) <= tried_[h]) continue;
      if (weigh(u, v).cost > most) continue;
      if (drop_end(h, most) || collapse(h)) {
        swept_[u] = round;
        if ((alive_ & 1023U) == 0) {
          if (progress.cancelled()) return false;
          progress("reduce", 0.6 + 0.2 * (start - double(alive_)) / (start - double(stop)));
        }
      } else {
        tried_[h] = tried_[twins_[h]] = clock_;
      }
    }
    if (progress.cancelled()) return false;
    if (50 * (before - alive_) < before - fixed) break;
  }
  return true;
}

void SlabReducer::tolerate(Tolerance tolerance) {
  thorough_ = true;
  tried_.assign(tried_.size(), 0);
  const bool spread = tolerance.loss > 0 && tolerance_.loss == 0;
  tolerance_ = tolerance;
  if (!spread) return;
  // What is lost is told triangle by triangle.
  std::vector<Entry> pool;
  for (std::uint32_t f = 0; f < cage_.faces.size(); ++f) {
    if (!alive(f)) continue;
    const SlabShape shape(cage_.triangle(f, kInner), cage_.triangle(f, kOuter));
    const auto begin = static_cast<std::uint32_t>(pool.size());
    for_triangles(cage_.list(f), [&](std::uint32_t t) {
      if (!shape.is_apart(source_.triangle(t))) pool.push_back(Entry::triangle(t));
    });
    cage_.lists[f] = {begin, static_cast<std::uint32_t>(pool.size()) - begin};
  }
  listed_ = pool.size();
  cage_.pool = std::move(pool);
  gathered_ = false;
}

double SlabReducer::lost() const {
  enum class Place : std::uint8_t { Outside, Inside, Across };
  std::vector<Place> places(source_.faces.size(), Place::Outside);
  for (std::uint32_t f = 0; f < cage_.faces.size(); ++f) {
    if (!alive(f)) continue;
    const SlabShape shape(cage_.triangle(f, kInner), cage_.triangle(f, kOuter));
    for_triangles(cage_.list(f), [&](std::uint32_t t) {
      const Meeting m = shape.meet(source_.triangle(t));
      if (m == Meeting::Outer || m == Meeting::Inner) places[t] = Place::Across;
      if (m != Meeting::Apart && places[t] == Place::Outside) places[t] = Place::Inside;
    });
  }
  double all = 0, outside = 0;
  for (std::uint32_t t = 0; t < source_.faces.size(); ++t) {
    const double area = length(source_.cross_of(t));
    all += area;
    if (places[t] != Place::Inside) outside += places[t] == Place::Across ? 0.5 * area : area;
  }
  return all > 0 ? outside / all : 0;
}

bool SlabReducer::reduce(std::size_t target_count, const Progress& progress) {
  free_memory(swept_);
  queued_ = true;
  constexpr std::size_t kInVain = 50;  // a round that removes less than one in so many is the last; where nothing else
                                       // is left to try the second in a row that removes none
  constexpr std::size_t kDear = 10;    // the same where most edges resist, as each round tries them anew, and where the
                                       // lists are long
  // Where the sweep has stopped far above its goal most edges resist: patience takes more of them in less time.
  const bool stuck = alive_ > swept_to_ + swept_to_ / 2;
  const bool is_dear = stuck || source_.faces.size() > kLarge;
  few_ = stuck ? alive_ : std::max<std::size_t>(16 * target_count, 3200) - 1;
  // No part can have fewer than four slabs.
  std::uint32_t parts = 0;
  for (std::uint32_t f = 0; f < cage_.faces.size(); ++f)
    if (alive(f)) parts = std::max(parts, cage_.part_of(f) + 1);
  const std::size_t floor = std::max<std::size_t>(target_count, 4 * std::size_t{parts});
  const double start = double(alive_);
  int vain = 0;  // the last rounds that removed hardly any
  for (int round = 0; alive_ > target_count && round < 40; ++round) {
    if (progress.cancelled()) return false;
    const std::size_t before = alive_;
    fill_queue();
    std::size_t counter = 0;
    while (!queue_.empty() && alive_ > target_count) {
      if ((++counter & 255U) == 0) {
        if (progress.cancelled()) return false;
        if ((counter & 8191U) == 0)
          progress("reduce", 0.8 + 0.2 * std::log(start / double(alive_)) / std::log(start / double(target_count)));
      }
      std::pop_heap(queue_.begin(), queue_.end());
      const Candidate c = queue_.back();
      queue_.pop_back();
      if (stamps_[c.u] != c.stamp_u || stamps_[c.v] != c.stamp_v) continue;
      std::uint32_t h = kNone;
      for_ring(c.u, [&](std::uint32_t e) {
        if (target(e) == c.v) h = e;
      });
      if (h == kNone || std::max(touched_[c.u], touched_[c.v]) <= tried_[h]) continue;
      if (!collapse(h)) tried_[h] = tried_[twins_[h]] = clock_;
    }
    const std::size_t removed = before - alive_;
    if (alive_ <= floor) break;
    if (is_dear && round >= 1 && removed < before / kDear) break;
    if (!stuck && alive_ >= 20000 && 10 * removed >= before) continue;
    const auto improve_all = [&] {
      for (std::uint32_t v = 0; v < out_.size(); ++v) {
        if (out_[v] == kNone || touched_[v] <= improved_[v]) continue;
        improve(v);
        if (thorough_) settle(v);
        if (folds_at_will()) even_out(v);
        improved_[v] = clock_;
        if ((v & 63U) == 0 && progress.cancelled()) return false;
      }
      return true;
    };
    const auto lengthen_all = [&] {
      for (const double share : {0.5, 0.15})
        for (std::uint32_t v = 0; v < out_.size(); ++v) {
          if (out_[v] != kNone) lengthen(v, share);
          if ((v & 63U) == 0 && progress.cancelled()) return false;
        }
      return true;
    };
    if (!improve_all()) return false;
    for (std::uint32_t h = 0; h < twins_.size(); ++h)
      if (alive(h / 3) && h < twins_[h]) flip(h);
    if (!improve_all()) return false;
    // Long fibres leave more room for collapses where they grow away from the source, short ones where they grow
    // towards others: by turns.
    if (thorough_ && round % 2 == 0 && !lengthen_all()) return false;
    const bool is_last_chance = folds_at_will() && before < 16 * target_count;
    const std::size_t few = is_last_chance ? 2 : std::max<std::size_t>(2, before / kInVain);
    vain = removed < few ? vain + 1 : 0;
    if (alive_ <= floor || (round >= 3 && vain >= (is_last_chance ? 2 : 1))) break;
  }
  return true;
}

void SlabReducer::lengthen(std::uint32_t v, double share) {
  star_of(v);
  const Vec3d in = to_double(cage_.ends[v][kInner]), out = to_double(cage_.ends[v][kOuter]), d = out - in;
  const double size = length(d), most = 0.999 * longest_ / size - 1;
  if (most < 0.05) return;
  const double both = std::min(share, most / 2), one = std::min(share, most);
  if (try_ends(cage_.at[v], {snap(in - d * both), snap(out + d * both)})) return;
  if (try_ends(cage_.at[v], {cage_.ends[v][kInner], snap(out + d * one)})) return;
  try_ends(cage_.at[v], {snap(in - d * one), cage_.ends[v][kOuter]});
}

// Room to carve and to add.
bool SlabReducer::thicken(const Progress& progress) {
  // Nothing is merged any more.
  free_memory(cage_.quadrics, queue_, tried_, stamps_);
  for (const double share : {0.5, 0.15}) {
    // Where nothing has changed since it would fail again.
    std::fill(improved_.begin(), improved_.end(), 0U);
    for (int round = 0; round < 4; ++round) {
      if (progress.cancelled()) return false;
      for (std::uint32_t v = 0; v < out_.size(); ++v) {
        if (out_[v] == kNone || touched_[v] <= improved_[v]) continue;
        improved_[v] = clock_;
        lengthen(v, share);
      }
    }
  }
  return true;
}

}  // namespace relief::detail
