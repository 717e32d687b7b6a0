#include <relief/base/try.h>
#include <relief/core/detail.h>
#include <relief/file/cage_rows.h>
#include <relief/file/checksum.h>
#include <relief/file/model_rows.h>
#include <relief/file/tile_codec.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <functional>
#include <set>
#include <span>
#include <utility>

namespace relief::detail {

namespace {

/// What stands behind the number of the stroke and a space in the names of parts. Then come those of grids.
constexpr std::array<std::string_view, 7> kKinds = {"fibres",   "slabs",       "cuts",   "moved fibres",
                                                    "new cuts", "certificate", "carried"};
constexpr int kCuts = 2, kCertificate = 5;
constexpr std::string_view kGrid = "grid of ", kNewGrid = "new grid of ";

/// Cuts and what is packed with them: what is built from a cut takes about 300 times its bytes.
constexpr std::size_t kMaxCutExpansion = 1;

/// A fibre of a root that a stroke moved; whole numbers of this size have no rounding.
struct MovedFibre {
  double number;
  std::array<double, 6> ends;
};
static_assert(sizeof(MovedFibre) == 7 * sizeof(double));

struct NewGrid {
  std::uint32_t slab, intervals;
};

struct PlainFace {
  std::array<std::uint32_t, 4> numbers;
};

std::string part_name(std::int64_t stroke, std::string_view what, std::string_view layer = {}) {
  return std::to_string(stroke).append(" ").append(what).append(layer);
}

std::array<double, 6> ends_of(const Fibre& f) {
  return {f.inner.x, f.inner.y, f.inner.z, f.outer.x, f.outer.y, f.outer.z};
}
Fibre fibre_from(const std::array<double, 6>& v) { return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}; }

std::vector<std::array<double, 6>> plain(std::span<const Fibre> fibres) {
  std::vector<std::array<double, 6>> values;
  values.reserve(fibres.size());
  for (const Fibre& f : fibres) values.push_back(ends_of(f));
  return values;
}
std::vector<PlainFace> plain(std::span<const SlabMesh::Face> faces) {
  std::vector<PlainFace> values;
  values.reserve(faces.size());
  for (const auto& [fibres, intervals] : faces)
    values.push_back({{fibres[0], fibres[1], fibres[2], static_cast<std::uint32_t>(intervals)}});
  return values;
}

void take_fibres(std::span<const std::array<double, 6>> values, CageState& cage) {
  cage.fibres.clear();
  for (const auto& ends : values) cage.fibres.push_back(fibre_from(ends));
}
void take_roots(std::span<const PlainFace> values, CageState& cage) {
  cage.roots.clear();
  for (const auto& [v] : values)
    cage.roots.push_back({{v[0], v[1], v[2]}, v[3] > kMaxIntervals ? 0 : static_cast<int>(v[3])});
}

bool same_bits(const Fibre& a, const Fibre& b) noexcept { return std::memcmp(&a, &b, sizeof a) == 0; }

template <typename Value>
std::span<const std::byte> bytes_in(const std::vector<Value>& values) {
  return std::as_bytes(std::span(values));
}

template <typename Visit>
void for_each_gridded(Visit&& visit) {
  for (int k = 0; k < kLayerCount; ++k)
    if (const auto layer = static_cast<Layer>(k); layer == Layer::Displacement || !has_own_intervals(layer))
      visit(layer);
}

}  // namespace

bool is_uniform(const Grid& grid) noexcept {
  return std::ranges::adjacent_find(grid, std::not_equal_to()) == grid.end();
}

bool CageState::has_sound_grids() const noexcept {
  return std::ranges::all_of(grids, [](const Grid& grid) {
    return std::ranges::all_of(grid, [](int n) { return n >= 1 && n <= kMaxIntervals; });
  });
}

bool CageState::cut(SlabId slab) {
  if (slab >= slab_count() || levels[slab] >= kMaxLevel || levels.size() + 3 >= kNoSlab / 4) return false;
  const auto level = static_cast<std::uint8_t>(levels[slab] + 1);
  levels[slab] = level;
  levels.insert(levels.end(), 3, level);
  for (Grid& grid : grids) {
    if (grid.empty()) continue;
    const auto n = static_cast<std::uint8_t>(after_cuts(grid[slab], 1));
    grid[slab] = n;
    grid.insert(grid.end(), 3, n);
  }
  cuts.push_back(slab);
  return true;
}

CageState cage_of(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  CageState cage;
  cage.fibres.assign(mesh.root_fibres().begin(), mesh.root_fibres().end());
  for (const Slab& root : mesh.roots()) cage.roots.push_back({root.fibres, root.intervals});
  cage.cuts.assign(mesh.cuts().begin(), mesh.cuts().end());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) cage.levels.push_back(static_cast<std::uint8_t>(mesh.level(s)));
  for_each_gridded([&](Layer layer) {
    for (SlabId s = 0; model.has(layer) && s < mesh.slab_count(); ++s) {
      cage.grids[static_cast<std::size_t>(layer)].push_back(static_cast<std::uint8_t>(model.intervals(layer, s)));
      if (!has_own_intervals(layer)) model.tile(layer, s).rest();  // it was looked at
    }
  });
  return cage;
}

bool is_of(const CageState& cage, const SlabMesh& mesh) noexcept {
  const auto same_face = [](const SlabMesh::Face& a, const Slab& b) {
    return a.fibres == b.fibres && a.intervals == b.intervals;
  };
  const auto same_grid = [](std::uint8_t n, const Slab& slab) { return n == slab.intervals; };
  return std::ranges::equal(cage.cuts, mesh.cuts()) &&
         std::ranges::equal(cage.grid(Layer::Displacement), mesh.slabs(), same_grid) &&
         std::ranges::equal(cage.roots, mesh.roots(), same_face) &&
         std::ranges::equal(cage.fibres, mesh.root_fibres(), same_bits);
}

Result<std::shared_ptr<const SlabMesh>> mesh_of(const CageState& cage) {
  RELIEF_TRY(SlabMesh mesh, SlabMesh::make(cage.fibres, cage.roots));
  if (!cage.cuts.empty()) {
    RELIEF_TRY(mesh, mesh.cut(cage.cuts));
  }
  const Grid& grid = cage.grid(Layer::Displacement);
  if (!std::ranges::equal(grid, mesh.slabs(), [](int n, const Slab& slab) { return n == slab.intervals; })) {
    RELIEF_TRY(mesh, mesh.refined(std::vector<int>(grid.begin(), grid.end())));
  }
  return std::make_shared<const SlabMesh>(std::move(mesh));
}

CageChange change_between(const CageState& before, const CageState& after) noexcept {
  const bool same_faces =
      std::ranges::equal(before.roots, after.roots, {}, &SlabMesh::Face::fibres, &SlabMesh::Face::fibres);
  if (!same_faces || before.fibres.size() != after.fibres.size() || before.cuts.size() > after.cuts.size() ||
      !std::equal(before.cuts.begin(), before.cuts.end(), after.cuts.begin()))
    return CageChange::Anew;
  const bool same_intervals =
      std::ranges::equal(before.roots, after.roots, {}, &SlabMesh::Face::intervals, &SlabMesh::Face::intervals);
  return same_intervals ? CageChange::Step : CageChange::Roots;
}

bool same_places(const CageState& a, const CageState& b) noexcept {
  return std::ranges::equal(a.fibres, b.fibres, same_bits);
}

TilePtr carried_tile(const TilePtr& from, Layer layer, const RootPlace& part, int m) {
  if (part.level == 0 && from->intervals() == m) return from;
  if (!can_carry(from->intervals(), part, m)) return std::make_shared<Tile>(layer, m, 0.0F);
  return part_of(*from, layer, part, m);
}

std::optional<CagePart> CagePart::from_name(std::string_view part) noexcept {
  CagePart found;
  const auto error = std::from_chars(part.data(), part.data() + part.size(), found.stroke).ec;
  if (error != std::errc() || found.stroke < 0) return std::nullopt;
  const std::string number = part_name(found.stroke, {});  // spelt as we do
  if (!part.starts_with(number)) return std::nullopt;
  const std::string_view what = part.substr(number.size());
  if (const auto at = std::ranges::find(kKinds, what); at != kKinds.end()) {
    found.kind = static_cast<int>(at - kKinds.begin());
    return found;
  }
  for (const auto& [grid, first] : {std::pair(kGrid, 0), std::pair(kNewGrid, kLayerCount)})
    if (what.starts_with(grid))
      if (const auto layer = layer_from_name(what.substr(grid.size()))) {
        found.kind = static_cast<int>(kKinds.size()) + first + static_cast<int>(*layer);
        return found;
      }
  return std::nullopt;
}

bool is_first_part(std::string_view part) noexcept { return part == "fibres" || part == "slabs"; }

bool CagePart::makes_cage_anew() const noexcept { return kind == kCuts; }
bool CagePart::is_needed() const noexcept { return kind != kCertificate; }

// ---- Writing

Status CageRows::write(std::string_view part, Bytes raw, std::size_t width, std::size_t expansion,
                       std::size_t least) const {
  std::vector<std::byte> blob = pack(raw, width, expansion);
  pad(blob, least);
  RELIEF_TRY(Statement put, database_.prepare("INSERT INTO cage VALUES(?, ?, ?)"));
  return put.bind(part).bind(hash_of(part, blob)).bind(Bytes(blob)).run();
}

Status CageRows::write_grid(std::int64_t stroke, Layer layer, const Grid& grid) const {
  return write(part_name(stroke, kGrid, name(layer)), bytes_in(grid), 1, kMaxCageExpansion);
}

Result<std::int64_t> CageRows::write_first(const CageState& cage) const {
  RELIEF_CHECK(write("fibres", bytes_in(plain(cage.fibres)), sizeof(double), kMaxCageExpansion));
  RELIEF_CHECK(write("slabs", bytes_in(plain(cage.roots)), sizeof(std::uint32_t), kMaxCageExpansion));
  bool is_plain = cage.cuts.empty() && std::ranges::equal(
                                           cage.grid(Layer::Displacement), cage.roots, {},
                                           [](std::uint8_t n) -> int { return n; }, &SlabMesh::Face::intervals);
  for_each_gridded(
      [&](Layer layer) { is_plain = is_plain && (layer == Layer::Displacement || is_uniform(cage.grid(layer))); });
  if (is_plain) return 0;
  RELIEF_CHECK(write(part_name(0, "cuts"), bytes_in(cage.cuts), sizeof(SlabId), kMaxCutExpansion));
  std::int64_t rows = 1;
  for (std::size_t k = 0; k < cage.grids.size(); ++k) {
    if (cage.grids[k].empty()) continue;
    RELIEF_CHECK(write_grid(0, static_cast<Layer>(k), cage.grids[k]));
    ++rows;
  }
  return rows;
}

Result<std::int64_t> CageRows::write_whole(std::int64_t stroke, const CageState& cage,
                                           std::string_view certificate) const {
  RELIEF_CHECK(write(part_name(stroke, "fibres"), bytes_in(plain(cage.fibres)), sizeof(double), kMaxCageExpansion));
  RELIEF_CHECK(
      write(part_name(stroke, "slabs"), bytes_in(plain(cage.roots)), sizeof(std::uint32_t), kMaxCageExpansion));
  RELIEF_CHECK(write(part_name(stroke, "cuts"), bytes_in(cage.cuts), sizeof(SlabId), kMaxCutExpansion));
  RELIEF_CHECK(write(part_name(stroke, "certificate"), bytes_of(certificate), 1, kMaxExpansion));
  std::int64_t rows = 4;
  for (std::size_t k = 0; k < cage.grids.size(); ++k) {
    if (cage.grids[k].empty()) continue;
    RELIEF_CHECK(write_grid(stroke, static_cast<Layer>(k), cage.grids[k]));
    ++rows;
  }
  return rows;
}

Result<std::int64_t> CageRows::write_step(std::int64_t stroke, const CageState& before, const CageState& after,
                                          std::string_view certificate, std::size_t carried) const {
  std::int64_t rows = 0;
  const auto put = [&](std::string_view what, std::string_view layer, Bytes raw, std::size_t width,
                       std::size_t expansion, std::size_t least = 0) -> Status {
    ++rows;
    return write(part_name(stroke, what, layer), raw, width, expansion, least);
  };
  std::vector<MovedFibre> moved;
  for (std::size_t f = 0; f < after.fibres.size(); ++f)
    if (!same_bits(before.fibres[f], after.fibres[f]))
      moved.push_back({static_cast<double>(f), ends_of(after.fibres[f])});
  if (!moved.empty()) {
    RELIEF_CHECK(put("moved fibres", {}, bytes_in(moved), sizeof(double), kMaxCageExpansion));
    RELIEF_CHECK(put("certificate", {}, bytes_of(certificate), 1, kMaxExpansion));
  }
  CageState expected = before;
  const std::vector<SlabId> cuts(after.cuts.begin() + static_cast<std::ptrdiff_t>(before.cuts.size()),
                                 after.cuts.end());
  for (const SlabId s : cuts)
    if (!expected.cut(s)) return damaged(stroke, "does not make sense");
  if (!cuts.empty()) RELIEF_CHECK(put("new cuts", {}, bytes_in(cuts), sizeof(SlabId), kMaxCutExpansion));
  for (std::size_t k = 0; k < after.grids.size(); ++k) {
    std::vector<NewGrid> grids;
    for (SlabId s = 0; s < after.grids[k].size() && !expected.grids[k].empty(); ++s)
      if (after.grids[k][s] != expected.grids[k][s]) grids.push_back({s, after.grids[k][s]});
    if (!grids.empty())
      RELIEF_CHECK(
          put(kNewGrid, name(static_cast<Layer>(k)), bytes_in(grids), sizeof(std::uint32_t), kMaxCageExpansion));
  }
  if (carried > 0) {
    const std::vector<std::uint32_t> rule = {kCarryRule};
    RELIEF_CHECK(put("carried", {}, bytes_in(rule), sizeof(std::uint32_t), kMaxExpansion, carried / kMaxExpansion + 1));
  }
  return rows;
}

Status CageRows::drop_after(std::int64_t stroke) const {
  RELIEF_TRY(Statement drop, database_.prepare("DELETE FROM cage WHERE CAST(part AS INTEGER) > ?"));
  return drop.bind(stroke).run();
}

// ---- Reading

std::unexpected<Error> CageRows::damaged(std::int64_t stroke, std::string_view what) const {
  return database_.damaged("its cage at stroke " + std::to_string(stroke) + " " + std::string(what));
}

Result<std::optional<std::vector<std::byte>>> CageRows::read(std::string_view part, std::size_t width,
                                                             std::size_t expansion, std::size_t* packed) const {
  RELIEF_TRY(Statement get, database_.prepare("SELECT hash, data FROM cage WHERE part = ?"));
  RELIEF_TRY(const bool row, get.bind(part).step());
  if (!row) return std::nullopt;
  const auto fault = [&](std::string_view what) {
    const auto of_stroke = CagePart::from_name(part);
    return of_stroke ? damaged(of_stroke->stroke, what)
                     : database_.damaged("the " + std::string(part) + " of its cage " + std::string(what));
  };
  const Bytes blob = get.blob(1);
  if (get.integer(0) != hash_of(part, blob)) return fault("fails its checksum");
  const auto size = unpacked_size(blob);
  if (!size || *size % width != 0 || !may_hold(blob, *size, expansion)) return fault("claims more than it can hold");
  std::vector<std::byte> raw(*size);
  if (!unpack(blob, width, raw)) return fault("cannot be unpacked");
  if (packed != nullptr) *packed = blob.size();
  return raw;
}

template <typename Value>
Result<std::optional<std::vector<Value>>> CageRows::read_values(std::string_view part, std::size_t expansion) const {
  constexpr std::size_t kWidth = std::min(alignof(Value), sizeof(double));
  RELIEF_TRY(const auto raw, read(part, kWidth, expansion));
  if (!raw) return std::nullopt;
  if (raw->size() % sizeof(Value) != 0)
    return database_.damaged("the part '" + std::string(part) + "' of its cage has the wrong size");
  std::vector<Value> values(raw->size() / sizeof(Value));
  if (!values.empty()) std::memcpy(values.data(), raw->data(), raw->size());
  return values;
}

Result<std::int64_t> CageRows::last_whole(std::int64_t stroke) const {
  RELIEF_TRY(Statement get,
             database_.prepare("SELECT max(CAST(part AS INTEGER)) FROM cage WHERE part LIKE '% cuts' AND "
                               "part NOT LIKE '% new cuts' AND CAST(part AS INTEGER) <= ?"));
  RELIEF_TRY(const bool row, get.bind(stroke).step());
  return row ? get.integer(0) : 0;
}

Result<std::int64_t> CageRows::slabs_made_at(std::int64_t stroke, const Meta& meta) const {
  RELIEF_TRY(std::int64_t whole, last_whole(stroke));
  RELIEF_TRY(CageState now, read_whole(whole, meta));
  while (whole > 0) {
    RELIEF_TRY(const std::int64_t before, last_whole(whole - 1));
    RELIEF_TRY(CageState earlier, read_whole(before, meta));
    if (!has_slabs_of({now.fibres, now.roots, now.cuts}, {earlier.fibres, earlier.roots, earlier.cuts})) break;
    whole = before;
    now = std::move(earlier);
  }
  return whole;
}

Result<std::vector<std::int64_t>> CageRows::changes(std::int64_t after, std::int64_t last) const {
  std::set<std::int64_t> strokes;
  RELIEF_TRY(Statement rows, database_.prepare("SELECT part FROM cage"));
  for (;;) {
    RELIEF_TRY(const bool row, rows.step());
    if (!row) return std::vector<std::int64_t>(strokes.begin(), strokes.end());
    const std::string_view name = rows.text(0);
    if (is_first_part(name)) continue;
    const auto part = CagePart::from_name(name);
    if (!part) return database_.damaged("it has a part of its cage that no stroke writes");
    if (part->stroke > after && part->stroke <= last) strokes.insert(part->stroke);
  }
}

Result<CageState> CageRows::read_whole(std::int64_t stroke, const Meta& meta) const {
  const bool first = stroke == 0;
  CageState cage;
  using Ends = std::array<double, 6>;
  RELIEF_TRY(const auto fibres,
             read_values<Ends>(first ? std::string("fibres") : part_name(stroke, "fibres"), kMaxCageExpansion));
  RELIEF_TRY(const auto roots,
             read_values<PlainFace>(first ? std::string("slabs") : part_name(stroke, "slabs"), kMaxCageExpansion));
  RELIEF_TRY(const auto cuts, read_values<SlabId>(part_name(stroke, "cuts"), kMaxCutExpansion));
  for (const auto& [is_there, part] : {std::pair(fibres.has_value(), "fibres"), std::pair(roots.has_value(), "slabs"),
                                       std::pair(cuts.has_value() || first, "cuts")})
    if (!is_there) return damaged(stroke, std::string("lacks its ") + part);
  if (first && static_cast<std::int64_t>(fibres->size()) != meta.fibres)
    return database_.damaged("its cage has another number of fibres than it says");
  if (first && static_cast<std::int64_t>(roots->size()) != meta.slabs)
    return database_.damaged("its cage has another number of slabs than it says");
  take_fibres(*fibres, cage);
  take_roots(*roots, cage);
  cage.levels.assign(cage.roots.size(), 0);
  // Where cuts follow, the grids are told, too.
  Grid& grid = cage.grids[static_cast<std::size_t>(Layer::Displacement)];
  for (const SlabMesh::Face& root : cage.roots) grid.push_back(static_cast<std::uint8_t>(root.intervals));
  for (const SlabId s : cuts.value_or(std::vector<SlabId>{}))
    if (!cage.cut(s)) return damaged(stroke, "cuts a slab that cannot be cut");
  if (!cuts) return cage;
  Status read;
  for_each_gridded([&](Layer layer) {
    if (!read) return;
    auto told = read_values<std::uint8_t>(part_name(stroke, kGrid, name(layer)), kMaxCageExpansion);
    if (!told)
      read = std::unexpected(told.error());
    else if (*told ? (*told)->size() != cage.slab_count() : layer == Layer::Displacement)
      read = damaged(stroke, "lacks a grid");
    else if (*told)
      cage.grids[static_cast<std::size_t>(layer)] = *std::move(*told);
  });
  RELIEF_CHECK(read);
  return cage;
}

Result<CageRows::Step> CageRows::apply(std::int64_t stroke, CageState& cage) const {
  RELIEF_TRY(const auto cuts, read_values<SlabId>(part_name(stroke, "cuts"), kMaxCutExpansion));
  if (cuts) {
    RELIEF_TRY(cage, read_whole(stroke, {}));
    return Step{.whole = true, .new_cuts = {}};
  }
  Step step;
  RELIEF_TRY(const auto moved, read_values<MovedFibre>(part_name(stroke, "moved fibres"), kMaxCageExpansion));
  for (const auto& [number, ends] : moved.value_or(std::vector<MovedFibre>{})) {
    if (!(number >= 0 && number < static_cast<double>(cage.fibres.size())))
      return damaged(stroke, "moves a fibre that does not exist");
    cage.fibres[static_cast<std::size_t>(number)] = fibre_from(ends);
  }
  RELIEF_TRY(auto new_cuts, read_values<SlabId>(part_name(stroke, "new cuts"), kMaxCutExpansion));
  step.new_cuts = std::move(new_cuts).value_or(std::vector<SlabId>{});
  for (const SlabId s : step.new_cuts)
    if (!cage.cut(s)) return damaged(stroke, "cuts a slab that cannot be cut");
  for (std::size_t k = 0; k < cage.grids.size(); ++k) {
    const std::string_view layer = name(static_cast<Layer>(k));
    RELIEF_TRY(auto whole, read_values<std::uint8_t>(part_name(stroke, kGrid, layer), kMaxCageExpansion));
    if (whole) cage.grids[k] = *std::move(whole);
    if (!cage.grids[k].empty() && cage.grids[k].size() != cage.slab_count())
      return damaged(stroke, "has a grid of the wrong size");
    RELIEF_TRY(const auto grids, read_values<NewGrid>(part_name(stroke, kNewGrid, layer), kMaxCageExpansion));
    for (const auto& [slab, intervals] : grids.value_or(std::vector<NewGrid>{})) {
      if (slab >= cage.grids[k].size() || intervals < 1 || intervals > kMaxIntervals)
        return damaged(stroke, "has a grid of no slab");
      cage.grids[k][slab] = static_cast<std::uint8_t>(intervals);
    }
  }
  std::size_t packed = 0;
  RELIEF_TRY(const auto rule, read(part_name(stroke, "carried"), sizeof(std::uint32_t), kMaxExpansion, &packed));
  if (rule) {
    std::uint32_t number = 0;
    if (rule->size() != sizeof number) return damaged(stroke, "has the wrong size");
    std::memcpy(&number, rule->data(), sizeof number);
    if (number != kCarryRule)
      return database_.failure(Errc::NewerVersion, "carries its tiles over by rule " + std::to_string(number) +
                                                       ", which this program does not know: update Relief");
    step.may_carry = packed * kMaxExpansion;
  }
  return step;
}

Result<std::string> CageRows::certificate(std::int64_t stroke, const Meta& meta) const {
  RELIEF_TRY(Statement get,
             database_.prepare("SELECT part FROM cage WHERE part LIKE '% certificate' AND CAST(part AS INTEGER) <= ? "
                               "ORDER BY CAST(part AS INTEGER) DESC LIMIT 1"));
  RELIEF_TRY(const bool row, get.bind(stroke).step());
  if (!row) return meta.certificate;
  RELIEF_TRY(const auto text, read(get.text(0), 1, kMaxExpansion));
  return text ? std::string(reinterpret_cast<const char*>(text->data()), text->size()) : meta.certificate;
}

}  // namespace relief::detail
