#include <relief/base/assert.h>
#include <relief/base/hash.h>
#include <relief/base/try.h>
#include <relief/core/plain_cage.h>
#include <relief/core/query.h>
#include <relief/file/checksum.h>
#include <relief/file/database.h>
#include <relief/file/history_check.h>
#include <relief/file/model_file.h>
#include <relief/file/model_rows.h>
#include <relief/file/tile_codec.h>
#include <relief/verify/verify.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace relief {

namespace {

using detail::Bytes;
using detail::bytes_of;
using detail::Database;
using detail::hash_of;
using detail::kFibreBytes;
using detail::kSlabBytes;
using detail::Meta;
using detail::Replacement;
using detail::Statement;
using detail::stored;

constexpr std::int64_t kApplicationId = 0x524c4631;  // "RLF1"
constexpr std::int64_t kLayerGone = -1;   // layers.intervals: the stroke took the layer away; 0 is kOwnIntervals
constexpr std::int64_t kWholeEvery = 64;  // after so many changes of a page it is written whole again
constexpr std::size_t kMaxText = std::size_t{1} << 26;

constexpr std::array<detail::FileKind::Table, 5> kTables = {{
    {"meta", "CREATE TABLE meta(key TEXT PRIMARY KEY, value ANY NOT NULL) STRICT"},
    {"cage", "CREATE TABLE cage(part TEXT PRIMARY KEY, hash INTEGER NOT NULL, data BLOB NOT NULL) STRICT"},
    {"layers",
     "CREATE TABLE layers(layer TEXT NOT NULL, stroke INTEGER NOT NULL, intervals INTEGER NOT NULL, "
     "hash INTEGER NOT NULL, PRIMARY KEY(layer, stroke)) STRICT"},
    {"pages",
     "CREATE TABLE pages(layer TEXT NOT NULL, page INTEGER NOT NULL, stroke INTEGER NOT NULL, whole INTEGER NOT NULL, "
     "tiles INTEGER NOT NULL, hash INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY(layer, page, stroke)) STRICT"},
    {"strokes",
     "CREATE TABLE strokes(number INTEGER PRIMARY KEY, label TEXT NOT NULL, details TEXT NOT NULL, "
     "tiles INTEGER NOT NULL, row_count INTEGER NOT NULL, hash INTEGER NOT NULL) STRICT"},
}};
constexpr detail::FileKind kKind = {
    .suffix = ".relief", .application_id = kApplicationId, .newest_format = kFormatVersion, .tables = kTables};

std::int64_t hash_of(const StrokeRecord& s, std::int64_t row_count) {
  return hash_of(s.label, bytes_of(s.details), s.number, s.tiles, row_count);
}

std::string certificate_text(const SlabMesh& mesh) {
  const PlainCage cage(mesh);
  const verify::Certificate found = verify::check({cage.inner, cage.outer, cage.triangles});
  std::string text;
  for (std::size_t k = 0; k < found.holds.size(); ++k) {
    if (!found.holds[k]) continue;
    if (!text.empty()) text += ' ';
    text += name(static_cast<verify::Condition>(k));
  }
  return text;
}

/// The verifier on the cage of a file that was read, against what the file says of it.
std::string doubt_about(const SlabMesh& mesh, Mode mode, std::string_view certificate, const Progress& progress) {
  const PlainCage cage(mesh);
  const verify::Certificate found = verify::check({cage.inner, cage.outer, cage.triangles}, progress);
  const auto missed = [&](std::size_t k) {
    const std::string_view condition = name(static_cast<verify::Condition>(k));
    const bool said = certificate.contains(condition) || (mode != Mode::Preview && claims(mode).contains(condition));
    return said && !found.holds[k];
  };
  std::string failing, untested;
  for (std::size_t k = 0; k < verify::kShellConditionCount; ++k) {
    if (!missed(k)) continue;
    std::string& list = found.failure_count[k] > 0 ? failing : untested;
    list += (list.empty() ? "" : ", ") + std::string(name(static_cast<verify::Condition>(k)));
  }
  if (failing.empty() && untested.empty()) return {};
  std::string text = failing.empty() ? "" : "its slabs do not hold " + failing;
  if (!untested.empty()) text += (text.empty() ? "" : ", and ") + untested + " could not be tested";
  for (const verify::Failure& f : found.failures)
    if (missed(static_cast<std::size_t>(f.condition))) return text + ": " + f.what;
  return text;
}

std::vector<std::byte> fibre_bytes(const SlabMesh& mesh) {
  std::vector<std::byte> raw(mesh.fibres().size() * kFibreBytes);
  for (std::size_t f = 0; f < mesh.fibres().size(); ++f) {
    const auto& [in, out] = mesh.fibres()[f];
    const std::array<double, 6> values = {in.x, in.y, in.z, out.x, out.y, out.z};
    std::memcpy(raw.data() + f * kFibreBytes, values.data(), kFibreBytes);
  }
  return raw;
}
std::vector<std::byte> slab_bytes(const SlabMesh& mesh) {
  std::vector<std::byte> raw(mesh.slabs().size() * kSlabBytes);
  for (std::size_t s = 0; s < mesh.slabs().size(); ++s) {
    const Slab& slab = mesh.slabs()[s];
    const std::array<std::uint32_t, 4> values = {slab.fibres[0], slab.fibres[1], slab.fibres[2],
                                                 static_cast<std::uint32_t>(slab.intervals)};
    std::memcpy(raw.data() + s * kSlabBytes, values.data(), kSlabBytes);
  }
  return raw;
}

SlabId page_count(const SlabMesh& mesh) { return (mesh.slab_count() + kTilesPerPage - 1) / kTilesPerPage; }
SlabId tiles_in_page(const SlabMesh& mesh, SlabId page) {
  return std::min(kTilesPerPage, mesh.slab_count() - page * kTilesPerPage);
}
std::uint64_t all_tiles(const SlabMesh& mesh, SlabId page) {
  return ~std::uint64_t{0} >> (kTilesPerPage - tiles_in_page(mesh, page));
}

/// One layer as it lies in the file: since which stroke, with how many intervals, and what its samples are there.
struct LayerEntry {
  std::int64_t stroke = 0;
  std::int64_t intervals = kOwnIntervals;
  SampleType type = SampleType::F32;
  friend bool operator==(const LayerEntry&, const LayerEntry&) = default;
};
using LayerTable = std::array<std::optional<LayerEntry>, kLayerCount>;

/// Up to format 2, colours were floats.
SampleType type_in_file(Layer layer, std::int64_t format) { return format < 3 ? SampleType::F32 : sample_type(layer); }

int intervals_of(const LayerEntry& entry, const SlabMesh& mesh, SlabId s) {
  return entry.intervals == kOwnIntervals ? mesh.intervals(s) : static_cast<int>(entry.intervals);
}

std::int64_t intervals_of(const Snapshot& model, Layer layer) {
  return has_own_intervals(layer) ? kOwnIntervals : model.tile(layer, 0).intervals();
}

/// Bytes of the tiles of a page that `mask` names, and where each begins.
struct PageLayout {
  std::array<std::size_t, kTilesPerPage + 1> begin{};
  std::uint64_t mask = 0;

  PageLayout(const LayerEntry& entry, Layer layer, const SlabMesh& mesh, SlabId page, std::uint64_t tiles)
      : mask(tiles) {
    for (SlabId t = 0; t < kTilesPerPage; ++t) {
      begin[t + 1] = begin[t];
      if (has(t))
        begin[t + 1] += detail::tile_bytes(layer, intervals_of(entry, mesh, page * kTilesPerPage + t), entry.type);
    }
  }
  [[nodiscard]] bool has(SlabId t) const { return (mask >> t & 1U) != 0; }
  [[nodiscard]] std::size_t bytes() const { return begin[kTilesPerPage]; }
  template <typename Byte>
  [[nodiscard]] std::span<Byte> tile(std::span<Byte> all, SlabId t) const {
    return all.subspan(begin[t], begin[t + 1] - begin[t]);
  }
};

/// The tiles of one page that a stroke changes.
struct PageChange {
  Layer layer;
  SlabId page;
  std::uint64_t tiles;
  bool whole;  ///< the layer is new, so there is nothing to differ from
};

/// Long work of so many steps: tells its share at most a hundred times, and looks at each step whether to stop.
class Steps {
 public:
  Steps(const Progress& progress, std::string_view phase, std::size_t count)
      : progress_(progress), phase_(phase), count_(count) {}
  /// False: the work was cancelled.
  [[nodiscard]] bool next() {
    if (done_ * 100 / count_ != (done_ + 1) * 100 / count_)
      progress_(phase_, static_cast<double>(done_ + 1) / static_cast<double>(count_));
    ++done_;
    return !progress_.cancelled();
  }

 private:
  const Progress& progress_;
  std::string_view phase_;
  std::size_t count_, done_ = 0;
};

class Rows {
 public:
  explicit Rows(const Database& database) : database_(database) {}

  // ---- Writing; all inside a transaction that the caller ends.

  [[nodiscard]] Status write_meta(const Meta& meta) const {
    RELIEF_TRY(Statement put, database_.prepare("INSERT OR REPLACE INTO meta VALUES(?, ?)"));
    const auto write = [&](std::string_view key, const auto& value) {
      put.reset();
      return put.bind(key).bind(value).run();
    };
    RELIEF_CHECK(write("format", meta.format));
    RELIEF_CHECK(write("mode", name(meta.info.mode)));
    RELIEF_CHECK(write("unit", name(meta.info.unit)));
    RELIEF_CHECK(write("source", std::string_view(meta.info.source)));
    RELIEF_CHECK(write("source_diagonal", meta.info.source_diagonal));
    RELIEF_CHECK(write("fibres", meta.fibres));
    RELIEF_CHECK(write("slabs", meta.slabs));
    RELIEF_CHECK(write("certificate", std::string_view(meta.certificate)));
    return write_place(meta, put);
  }
  [[nodiscard]] Status write_place(const Meta& meta) const {
    RELIEF_TRY(Statement put, database_.prepare("INSERT OR REPLACE INTO meta VALUES(?, ?)"));
    return write_place(meta, put);
  }

  [[nodiscard]] Status write_cage(const SlabMesh& mesh) const {
    RELIEF_TRY(Statement put, database_.prepare("INSERT INTO cage VALUES(?, ?, ?)"));
    const auto write = [&](std::string_view part, const std::vector<std::byte>& raw, std::size_t width) {
      const std::vector<std::byte> blob = detail::pack(raw, width, detail::kMaxCageExpansion);
      put.reset();
      return put.bind(part).bind(hash_of(part, blob)).bind(Bytes(blob)).run();
    };
    RELIEF_CHECK(write("fibres", fibre_bytes(mesh), sizeof(double)));
    return write("slabs", slab_bytes(mesh), sizeof(std::uint32_t));
  }

  [[nodiscard]] Status write_layer(Layer layer, const LayerEntry& entry) const {
    RELIEF_TRY(Statement put, database_.prepare("INSERT INTO layers VALUES(?, ?, ?, ?)"));
    return put.bind(name(layer))
        .bind(entry.stroke)
        .bind(entry.intervals)
        .bind(hash_of(name(layer), {}, entry.stroke, entry.intervals))
        .run();
  }

  /// Writes tiles of `now` in one row: as they are when the page is whole, else as differences to `before`.
  [[nodiscard]] Status write_page(const PageChange& change, const LayerEntry& entry, std::int64_t stroke,
                                  const Snapshot* before, const Snapshot& now) const {
    const SlabMesh& mesh = now.slab_mesh();
    const std::uint64_t mask = change.whole ? all_tiles(mesh, change.page) : change.tiles;
    const PageLayout layout(entry, change.layer, mesh, change.page, mask);
    std::vector<std::byte> raw(layout.bytes()), old;
    for (SlabId t = 0; t < kTilesPerPage; ++t) {
      if (!layout.has(t)) continue;
      const SlabId s = change.page * kTilesPerPage + t;
      const auto samples = layout.tile(std::span(raw), t);
      detail::copy_samples(now.tile(change.layer, s), entry.type, samples);
      if (change.whole) continue;
      old.resize(samples.size());
      detail::copy_samples(before->tile(change.layer, s), entry.type, old);
      detail::exclusive_or(samples, old);
    }
    const std::vector<std::byte> blob = detail::pack(raw, bytes(entry.type));
    const std::int64_t whole = change.whole ? 1 : 0;
    const auto tiles = std::bit_cast<std::int64_t>(mask);
    RELIEF_TRY(Statement put, database_.prepare("INSERT INTO pages VALUES(?, ?, ?, ?, ?, ?, ?)"));
    return put.bind(name(change.layer))
        .bind(std::int64_t{change.page})
        .bind(stroke)
        .bind(whole)
        .bind(tiles)
        .bind(hash_of(name(change.layer), blob, change.page, stroke, whole, tiles))
        .bind(Bytes(blob))
        .run();
  }

  [[nodiscard]] Status write_stroke(const StrokeRecord& stroke, std::int64_t row_count) const {
    RELIEF_TRY(Statement put, database_.prepare("INSERT INTO strokes VALUES(?, ?, ?, ?, ?, ?)"));
    return put.bind(static_cast<std::int64_t>(stroke.number))
        .bind(std::string_view(stroke.label))
        .bind(std::string_view(stroke.details))
        .bind(static_cast<std::int64_t>(stroke.tiles))
        .bind(row_count)
        .bind(hash_of(stroke, row_count))
        .run();
  }

  [[nodiscard]] Status drop_strokes_after(std::int64_t stroke) const {
    for (const char* sql : {"DELETE FROM pages WHERE stroke > ?", "DELETE FROM layers WHERE stroke > ?",
                            "DELETE FROM strokes WHERE number > ?"}) {
      RELIEF_TRY(Statement drop, database_.prepare(sql));
      RELIEF_CHECK(drop.bind(stroke).run());
    }
    return {};
  }

  /// How often a page was changed since it was last written whole.
  [[nodiscard]] Result<std::int64_t> changes_since_whole(Layer layer, SlabId page) const {
    RELIEF_TRY(
        Statement count,
        database_.prepare("SELECT count(*) FROM pages WHERE layer = ?1 AND page = ?2 AND stroke > (SELECT max(stroke) "
                          "FROM pages WHERE layer = ?1 AND page = ?2 AND whole = 1)"));
    RELIEF_TRY(const bool row, count.bind(name(layer)).bind(std::int64_t{page}).step());
    return row ? count.integer(0) : 0;
  }

  // ---- Reading

  [[nodiscard]] Result<Meta> read_meta() const {
    std::map<std::string, std::int64_t, std::less<>> integers;
    std::map<std::string, std::string, std::less<>> texts;
    std::optional<double> diagonal;
    RELIEF_TRY(Statement rows, database_.prepare("SELECT key, value FROM meta LIMIT 100"));
    for (;;) {
      RELIEF_TRY(const bool row, rows.step());
      if (!row) break;
      const std::string key(rows.text(0));
      if (rows.type(1) == Statement::Type::Integer) integers[key] = rows.integer(1);
      if (rows.type(1) == Statement::Type::Text) texts[key] = rows.text(1);
      if (rows.type(1) == Statement::Type::Real && key == "source_diagonal") diagonal = rows.real(1);
    }
    for (const char* key : {"format", "fibres", "slabs", "current", "last", "checksum"})
      if (!integers.contains(key)) return damaged(std::string("it does not say its ") + key);
    for (const char* key : {"mode", "unit", "source", "certificate"})
      if (!texts.contains(key)) return damaged(std::string("it does not say its ") + key);
    const auto mode = mode_from_name(texts["mode"]);
    const auto unit = unit_from_name(texts["unit"]);
    if (!mode || !unit || !diagonal) return damaged("its facts do not make sense");
    Meta meta{.format = integers["format"],
              .info = {.mode = *mode, .unit = *unit, .source = texts["source"], .source_diagonal = *diagonal},
              .fibres = integers["fibres"],
              .slabs = integers["slabs"],
              .current = integers["current"],
              .last = integers["last"],
              .certificate = texts["certificate"]};
    if (meta.checksum() != integers["checksum"]) return damaged("its facts fail their checksum");
    RELIEF_TRY(const std::int64_t version, database_.integer("PRAGMA user_version"));
    if (meta.format != version || meta.fibres < 3 || meta.slabs < 1 || meta.slabs > std::int64_t{1} << 30 ||
        meta.fibres > 3 * meta.slabs || meta.current < 0 || meta.current > meta.last ||
        !std::isfinite(meta.info.source_diagonal) || meta.info.source_diagonal < 0)
      return damaged("its facts do not make sense");
    return meta;
  }

  [[nodiscard]] Result<std::shared_ptr<const SlabMesh>> read_cage(const Meta& meta) const {
    const auto read = [&](std::string_view part, std::size_t bytes,
                          std::size_t width) -> Result<std::vector<std::byte>> {
      RELIEF_TRY(Statement get, database_.prepare("SELECT hash, data FROM cage WHERE part = ?"));
      RELIEF_TRY(const bool row, get.bind(part).step());
      if (!row) return damaged("it lacks the " + std::string(part) + " of its cage");
      const Bytes blob = get.blob(1);
      if (get.integer(0) != hash_of(part, blob)) return damaged("the " + std::string(part) + " fail their checksum");
      if (!detail::may_hold(blob, bytes, detail::kMaxCageExpansion))
        return damaged("it claims more " + std::string(part) + " than it can hold");
      std::vector<std::byte> raw(bytes);
      if (!detail::unpack(blob, width, raw)) return damaged("the " + std::string(part) + " cannot be unpacked");
      return raw;
    };
    RELIEF_TRY(const auto fibre_raw,
               read("fibres", static_cast<std::size_t>(meta.fibres) * kFibreBytes, sizeof(double)));
    RELIEF_TRY(const auto slab_raw,
               read("slabs", static_cast<std::size_t>(meta.slabs) * kSlabBytes, sizeof(std::uint32_t)));
    std::vector<Fibre> fibres(static_cast<std::size_t>(meta.fibres));
    for (std::size_t f = 0; f < fibres.size(); ++f) {
      std::array<double, 6> v{};
      std::memcpy(v.data(), fibre_raw.data() + f * kFibreBytes, kFibreBytes);
      fibres[f] = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    }
    std::vector<SlabMesh::Face> faces(static_cast<std::size_t>(meta.slabs));
    for (std::size_t s = 0; s < faces.size(); ++s) {
      std::array<std::uint32_t, 4> v{};
      std::memcpy(v.data(), slab_raw.data() + s * kSlabBytes, kSlabBytes);
      faces[s] = {{v[0], v[1], v[2]}, v[3] > kMaxIntervals ? 0 : static_cast<int>(v[3])};
    }
    auto mesh = SlabMesh::make(std::move(fibres), faces);
    if (!mesh) return damaged(mesh.error().message);
    return std::make_shared<const SlabMesh>(*std::move(mesh));
  }

  /// The layers in effect at a stroke. A damaged row matters until a later one of its layer takes its place.
  [[nodiscard]] Result<LayerTable> read_layers(std::int64_t stroke, std::int64_t format) const {
    LayerTable table;
    std::array<bool, kLayerCount> lost{};
    RELIEF_TRY(Statement rows, database_.prepare("SELECT * FROM layers WHERE stroke <= ? ORDER BY stroke"));
    rows.bind(stroke);
    for (;;) {
      RELIEF_TRY(const bool row, rows.step());
      if (!row) break;
      const auto layer = layer_from_name(rows.text(0));
      if (!layer) return damaged("it has a layer that does not exist");
      const auto k = static_cast<std::size_t>(*layer);
      lost[k] = !detail::layer_holds(rows);
      if (lost[k]) continue;
      const LayerEntry entry{
          .stroke = rows.integer(1), .intervals = rows.integer(2), .type = type_in_file(*layer, format)};
      const bool sound = *layer == Layer::Displacement   ? entry.intervals == kOwnIntervals && entry.stroke == 0
                         : entry.intervals == kLayerGone ? true
                         : has_own_intervals(*layer)     ? entry.intervals == kOwnIntervals
                                                         : entry.intervals >= 1 && entry.intervals <= kMaxIntervals;
      if (!sound || entry.stroke < 0) return damaged("its layers do not make sense");
      table[k] = entry.intervals == kLayerGone ? std::nullopt : std::optional(entry);
    }
    if (std::ranges::find(lost, true) != lost.end()) return damaged("its layers fail their checksum");
    if (!table[static_cast<std::size_t>(Layer::Displacement)]) return damaged("it has no displacement");
    return table;
  }

  /// One row of pages whose checksum holds.
  struct PageRow {
    std::int64_t stroke = 0;
    bool whole = false;
    std::uint64_t tiles = 0;
    Bytes data;
  };
  [[nodiscard]] Result<PageRow> page_row(const Statement& row, Layer layer, SlabId page) const {
    if (!detail::page_holds(row)) return page_damage(layer, page, row.integer(2), "fails its checksum");
    return PageRow{.stroke = row.integer(2),
                   .whole = row.integer(3) != 0,
                   .tiles = std::bit_cast<std::uint64_t>(row.integer(4)),
                   .data = row.blob(6)};
  }

  /// Pages with rows of strokes after the first and up to the last one named, in order.
  [[nodiscard]] Result<std::vector<std::pair<Layer, SlabId>>> touched_pages(std::int64_t after,
                                                                            std::int64_t last) const {
    std::vector<std::pair<Layer, SlabId>> pages;
    RELIEF_TRY(
        Statement rows,
        database_.prepare("SELECT DISTINCT layer, page FROM pages WHERE stroke > ? AND stroke <= ? ORDER BY 1, 2"));
    rows.bind(after).bind(last);
    for (;;) {
      RELIEF_TRY(const bool row, rows.step());
      if (!row) return pages;
      const auto layer = layer_from_name(rows.text(0));
      if (!layer || rows.integer(1) < 0 || rows.integer(1) >= kNoSlab) return damaged("it has a page of nothing");
      pages.emplace_back(*layer, static_cast<SlabId>(rows.integer(1)));
    }
  }

  /// The journal: strokes 1 to `last`.
  [[nodiscard]] Result<std::vector<StrokeRecord>> read_strokes(std::int64_t last) const {
    std::vector<StrokeRecord> strokes;
    RELIEF_TRY(Statement rows,
               database_.prepare("SELECT number, label, details, tiles, row_count, hash FROM strokes WHERE number "
                                 "BETWEEN 1 AND ? ORDER BY number"));
    rows.bind(last);
    for (;;) {
      RELIEF_TRY(const bool row, rows.step());
      if (!row) break;
      if (detail::stroke_holds(rows))
        strokes.push_back(record_in(rows));
      else
        strokes.push_back({.number = static_cast<std::uint64_t>(rows.integer(0)), .damaged = true});
    }
    if (strokes.size() != static_cast<std::size_t>(last)) return damaged("its journal of strokes has a gap");
    return strokes;
  }

  /// The samples of the tiles that a row holds, into `samples`.
  [[nodiscard]] Status unpack_row(const PageRow& row, const LayerEntry& entry, const PageLayout& layout, Layer layer,
                                  SlabId page, std::uint64_t allowed, std::vector<std::byte>& samples) const {
    if (row.stroke < entry.stroke || (row.tiles & ~allowed) != 0 || !detail::may_hold(row.data, layout.bytes()))
      return page_damage(layer, page, row.stroke, "does not fit the cage");
    samples.resize(layout.bytes());
    if (!detail::unpack(row.data, bytes(entry.type), samples))
      return page_damage(layer, page, row.stroke, "cannot be unpacked");
    return {};
  }

  /// The tiles of a page that the strokes after `after` up to `last` changed, on the other side of them than in
  /// `known`: a difference leads both ways. Nothing where one of them wrote the page whole, or fails its checksum.
  [[nodiscard]] Result<std::optional<std::array<TilePtr, kTilesPerPage>>> read_differences(
      const Snapshot& known, Layer layer, const LayerEntry& entry, SlabId page, std::int64_t after,
      std::int64_t last) const {
    // What the file has as another type was rounded when it was read: a difference would not lead back to it.
    if (entry.type != sample_type(layer)) return std::nullopt;
    const SlabMesh& mesh = known.slab_mesh();
    RELIEF_TRY(Statement rows, database_.prepare("SELECT * FROM pages WHERE layer = ? AND page = ? AND stroke > ? AND "
                                                 "stroke <= ? ORDER BY stroke"));
    rows.bind(name(layer)).bind(std::int64_t{page}).bind(after).bind(last);
    std::array<std::vector<std::byte>, kTilesPerPage> samples;
    std::vector<std::byte> part;
    for (;;) {
      RELIEF_TRY(const bool more, rows.step());
      if (!more) break;
      const auto row = page_row(rows, layer, page);
      if (!row || row->whole) return std::nullopt;
      const PageLayout changed(entry, layer, mesh, page, row->tiles);
      RELIEF_CHECK(unpack_row(*row, entry, changed, layer, page, all_tiles(mesh, page), part));
      for (SlabId t = 0; t < kTilesPerPage; ++t) {
        if (!changed.has(t)) continue;
        const auto difference = changed.tile(Bytes(part), t);
        if (samples[t].empty()) {
          samples[t].resize(difference.size());
          detail::copy_samples(known.tile(layer, page * kTilesPerPage + t), entry.type, samples[t]);
        }
        detail::exclusive_or(samples[t], difference);
      }
    }
    std::array<TilePtr, kTilesPerPage> tiles;
    for (SlabId t = 0; t < kTilesPerPage; ++t)
      if (!samples[t].empty())
        tiles[t] =
            detail::tile_from(samples[t], entry.type, layer, intervals_of(entry, mesh, page * kTilesPerPage + t));
    return tiles;
  }

  /// The tiles of a page as they stood after a stroke: its last whole row, then each later change.
  [[nodiscard]] Result<std::array<TilePtr, kTilesPerPage>> read_page(const SlabMesh& mesh, Layer layer,
                                                                     const LayerEntry& entry, SlabId page,
                                                                     std::int64_t stroke) const {
    RELIEF_TRY(
        Statement rows,
        database_.prepare("SELECT * FROM pages WHERE layer = ?1 AND page = ?2 AND "
                          "stroke <= ?3 AND stroke >= (SELECT max(stroke) FROM pages WHERE layer = ?1 AND page = ?2 "
                          "AND stroke <= ?3 AND whole = 1) ORDER BY stroke"));
    rows.bind(name(layer)).bind(std::int64_t{page}).bind(stroke);
    const PageLayout layout(entry, layer, mesh, page, all_tiles(mesh, page));
    std::vector<std::byte> all, part;
    for (;;) {
      RELIEF_TRY(const bool more, rows.step());
      if (!more) break;
      RELIEF_TRY(const PageRow row, page_row(rows, layer, page));
      const PageLayout changed(entry, layer, mesh, page, row.tiles);
      const bool first = all.empty();
      if (row.whole != first || (first && row.tiles != layout.mask))
        return page_damage(layer, page, row.stroke, "does not fit the cage");
      RELIEF_CHECK(unpack_row(row, entry, changed, layer, page, layout.mask, part));
      if (first) {
        all.swap(part);
        continue;
      }
      for (SlabId t = 0; t < kTilesPerPage; ++t)
        if (changed.has(t)) detail::exclusive_or(layout.tile(std::span(all), t), changed.tile(Bytes(part), t));
    }
    if (all.empty()) return page_damage(layer, page, stroke, "is missing");
    std::array<TilePtr, kTilesPerPage> tiles;
    for (SlabId t = 0; t < tiles_in_page(mesh, page); ++t) {
      const int n = intervals_of(entry, mesh, page * kTilesPerPage + t);
      tiles[t] = detail::tile_from(layout.tile(Bytes(all), t), entry.type, layer, n);
      if (!tiles[t]) return page_damage(layer, page, stroke, "holds values outside its range");
      if (t > 0 && tiles[t]->same_values(*tiles[t - 1])) tiles[t] = tiles[t - 1];
    }
    return tiles;
  }

  /// That every page of the layers is there at a stroke before memory is taken for them, so that what a file asks for
  /// is in proportion to its size.
  [[nodiscard]] Status check_pages(const SlabMesh& mesh, const LayerTable& layers, std::int64_t stroke) const {
    for (std::size_t k = 0; k < layers.size(); ++k) {
      const auto& entry = layers[k];
      if (!entry) continue;
      const auto layer = static_cast<Layer>(k);
      // Beside max(), the other columns are those of its row.
      RELIEF_TRY(Statement rows, database_.prepare("SELECT page, tiles, length(data), max(stroke) FROM pages WHERE "
                                                   "layer = ? AND stroke BETWEEN ? AND ? AND whole = 1 GROUP BY page "
                                                   "ORDER BY page"));
      rows.bind(name(layer)).bind(entry->stroke).bind(stroke);
      for (SlabId page = 0; page < page_count(mesh); ++page) {
        RELIEF_TRY(const bool more, rows.step());
        if (!more || rows.integer(0) != page) return page_damage(layer, page, entry->stroke, "is missing");
        const PageLayout layout(*entry, layer, mesh, page, all_tiles(mesh, page));
        if (std::bit_cast<std::uint64_t>(rows.integer(1)) != layout.mask ||
            layout.bytes() / detail::kMaxExpansion >
                static_cast<std::size_t>(std::max<std::int64_t>(rows.integer(2), 0)))
          return page_damage(layer, page, rows.integer(3), "does not fit the cage");
      }
      RELIEF_TRY(const bool more, rows.step());
      if (more) return damaged("it has more pages than its cage needs");
    }
    return {};
  }

  /// The first stroke that lacks rows which it wrote: from it on no state can be trusted; one after the last where all
  /// have theirs. Where a record is damaged, so that it cannot tell how many there were, the table of pages and its
  /// index vouch for each other. Error: Corrupt (the journal has a gap).
  [[nodiscard]] Result<std::int64_t> first_incomplete(const Meta& meta) const {
    RELIEF_TRY(Statement strokes, database_.prepare("SELECT count(*), min(number), max(number) FROM strokes"));
    RELIEF_TRY(const bool counted, strokes.step());
    if (!counted || strokes.integer(0) != meta.last + 1 || strokes.integer(1) != 0 || strokes.integer(2) != meta.last)
      return damaged("its journal of strokes has a gap");
    RELIEF_TRY(Statement short_ones,
               database_.prepare(
                   "SELECT number, label, details, tiles, row_count, hash FROM strokes LEFT JOIN (SELECT stroke, "
                   "count(*) AS found FROM (SELECT stroke FROM pages UNION ALL SELECT stroke FROM layers) GROUP "
                   "BY stroke) ON stroke = number WHERE row_count <> ifnull(found, 0) ORDER BY number"));
    for (;;) {
      RELIEF_TRY(const bool row, short_ones.step());
      if (!row) return meta.last + 1;
      if (detail::stroke_holds(short_ones)) return short_ones.integer(0);
    }
  }

  [[nodiscard]] std::unexpected<Error> damaged(std::string_view what) const { return database_.damaged(what); }
  [[nodiscard]] std::unexpected<Error> cancelled() const { return database_.cancelled(); }

 private:
  [[nodiscard]] static StrokeRecord record_in(const Statement& row) {
    return {.number = static_cast<std::uint64_t>(row.integer(0)),
            .label = std::string(row.text(1)),
            .details = std::string(row.text(2)),
            .tiles = static_cast<std::uint64_t>(row.integer(3))};
  }
  [[nodiscard]] static Status write_place(const Meta& meta, Statement& put) {
    const auto write = [&](std::string_view key, std::int64_t value) {
      put.reset();
      return put.bind(key).bind(value).run();
    };
    RELIEF_CHECK(write("current", meta.current));
    RELIEF_CHECK(write("last", meta.last));
    return write("checksum", meta.checksum());
  }
  [[nodiscard]] std::unexpected<Error> page_damage(Layer layer, SlabId page, std::int64_t stroke,
                                                   std::string_view what) const {
    return damaged("page " + std::to_string(page) + " of " + std::string(name(layer)) + " at stroke " +
                   std::to_string(stroke) + " " + std::string(what));
  }

  const Database& database_;
};

// ---- Snapshots from rows

std::size_t present(const LayerTable& layers) {
  return static_cast<std::size_t>(std::ranges::count_if(layers, [](const auto& entry) { return entry.has_value(); }));
}

/// The whole model at a stroke.
Result<SnapshotPtr> load(const Rows& rows, const std::shared_ptr<const SlabMesh>& mesh, const LayerTable& layers,
                         std::int64_t stroke, const Progress& progress) {
  RELIEF_CHECK(rows.check_pages(*mesh, layers, stroke));
  Steps pages(progress, "read", present(layers) * page_count(*mesh));
  SnapshotDraft draft(Snapshot::make(mesh));
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto& entry = layers[k];
    if (!entry) continue;
    const auto layer = static_cast<Layer>(k);
    if (layer != Layer::Displacement) draft.add_layer(layer, static_cast<int>(entry->intervals), 0.0F);
    for (SlabId page = 0; page < page_count(*mesh); ++page) {
      if (!pages.next()) return rows.cancelled();
      RELIEF_TRY(const auto tiles, rows.read_page(*mesh, layer, *entry, page, stroke));
      for (SlabId t = 0; t < tiles_in_page(*mesh, page); ++t) draft.put(layer, page * kTilesPerPage + t, tiles[t]);
      if (page % 256 == 255) (void)draft.finish();  // lets go of the tiles that were replaced
    }
  }
  SnapshotPtr loaded = draft.finish();
  Steps slabs(progress, "check", present(layers) * mesh->slab_count());
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto layer = static_cast<Layer>(k);
    for (SlabId s = 0; layers[k] && s < mesh->slab_count(); ++s) {
      if (!slabs.next()) return rows.cancelled();
      if (const Status sound = validate(*loaded, layer, s); !sound) return rows.damaged(sound.error().message);
      loaded->tile(layer, s).rest(4);  // with its neighbours
    }
  }
  return loaded;
}

/// The model at another stroke, from the one at hand; both have the same layers.
Result<SnapshotPtr> move(const Rows& rows, const SnapshotPtr& from, const LayerTable& layers, std::int64_t from_stroke,
                         std::int64_t to_stroke, const Progress& progress) {
  const SlabMesh& mesh = from->slab_mesh();
  RELIEF_TRY(const auto touched,
             rows.touched_pages(std::min(from_stroke, to_stroke), std::max(from_stroke, to_stroke)));
  Steps pages(progress, "read", touched.size());
  SnapshotDraft draft(from);
  std::vector<std::pair<Layer, SlabId>> changed;
  for (const auto& [layer, page] : touched) {
    if (!pages.next()) return rows.cancelled();
    const auto& entry = layers[static_cast<std::size_t>(layer)];
    if (!entry || page >= page_count(mesh)) continue;
    RELIEF_TRY(auto tiles, rows.read_differences(*from, layer, *entry, page, std::min(from_stroke, to_stroke),
                                                 std::max(from_stroke, to_stroke)));
    if (!tiles) {
      RELIEF_TRY(tiles, rows.read_page(mesh, layer, *entry, page, to_stroke));
    }
    for (SlabId t = 0; t < tiles_in_page(mesh, page); ++t) {
      const SlabId s = page * kTilesPerPage + t;
      if (!(*tiles)[t] || (*tiles)[t]->same_values(from->tile(layer, s))) continue;
      draft.put(layer, s, (*tiles)[t]);
      changed.emplace_back(layer, s);
    }
  }
  SnapshotPtr moved = draft.finish();
  for (const auto& [layer, s] : changed) {
    if (progress.cancelled()) return rows.cancelled();
    if (const Status sound = validate(*moved, layer, s); !sound) return rows.damaged(sound.error().message);
  }
  return moved;
}

/// Writes a new model into an empty database that nobody else sees yet.
Status write_model(const Database& database, const Model& model, const Meta& meta, const LayerTable& layers,
                   const Progress& progress) {
  const SlabMesh& mesh = model.head->slab_mesh();
  const Rows rows(database);
  RELIEF_CHECK(database.run("PRAGMA journal_mode = MEMORY"));
  RELIEF_CHECK(database.run("PRAGMA synchronous = OFF"));
  RELIEF_CHECK(database.run("BEGIN"));
  RELIEF_CHECK(database.write_tables());
  RELIEF_CHECK(rows.write_meta(meta));
  RELIEF_CHECK(rows.write_cage(mesh));
  Steps pages(progress, "save", present(layers) * page_count(mesh));
  std::int64_t row_count = 0;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto& entry = layers[k];
    if (!entry) continue;
    const auto layer = static_cast<Layer>(k);
    RELIEF_CHECK(rows.write_layer(layer, *entry));
    for (SlabId page = 0; page < page_count(mesh); ++page) {
      if (!pages.next()) return rows.cancelled();
      RELIEF_CHECK(rows.write_page({layer, page, 0, true}, *entry, 0, nullptr, *model.head));
    }
    row_count += 1 + std::int64_t{page_count(mesh)};
  }
  RELIEF_CHECK(rows.write_stroke({}, row_count));
  return database.run("COMMIT");
}

/// The model's facts and layers as a new file will hold them.
Meta meta_of(const Model& model) {
  const SlabMesh& mesh = model.head->slab_mesh();
  return {.info = model.info,
          .fibres = static_cast<std::int64_t>(mesh.fibres().size()),
          .slabs = std::int64_t{mesh.slab_count()},
          .certificate = certificate_text(mesh)};
}
LayerTable layers_of(const Snapshot& head) {
  LayerTable layers;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto layer = static_cast<Layer>(k);
    if (head.has(layer)) layers[k] = {.stroke = 0, .intervals = intervals_of(head, layer), .type = sample_type(layer)};
  }
  return layers;
}

}  // namespace

namespace detail {

const FileKind& model_kind() noexcept { return kKind; }

std::int64_t Meta::checksum() const {
  Hash64 hash;
  for (const std::int64_t number :
       {format, fibres, slabs, current, last, static_cast<std::int64_t>(info.mode),
        static_cast<std::int64_t>(info.unit), std::bit_cast<std::int64_t>(info.source_diagonal)})
    hash.add(static_cast<std::uint64_t>(number));
  hash.add_bytes(bytes_of(info.source));
  hash.add_bytes(bytes_of(certificate));
  return stored(hash);
}

Result<Meta> read_meta(const Database& database) { return Rows(database).read_meta(); }
Status write_meta(const Database& database, const Meta& meta) { return Rows(database).write_meta(meta); }
Status write_stroke(const Database& database, const StrokeRecord& stroke, std::int64_t row_count) {
  return Rows(database).write_stroke(stroke, row_count);
}

}  // namespace detail

struct ModelFile::State {
  Database database;
  bool read_only = false;
  Meta meta{};
  LayerTable layers{};
  Model model{};
  std::int64_t data_version = 0;  ///< differs once another program has written the file
  std::int64_t incomplete = std::numeric_limits<std::int64_t>::max();  ///< the first stroke that lacks rows

  /// Makes every commit durable, and keeps other writers out from now on; readers are let in except while we write.
  [[nodiscard]] Status lock() {
    RELIEF_CHECK(database.run("PRAGMA journal_mode = DELETE"));
    RELIEF_CHECK(database.run("PRAGMA synchronous = EXTRA"));
    RELIEF_CHECK(
        database.run("PRAGMA secure_delete = ON"));  // rows of dropped strokes are not found again by salvage()
    RELIEF_CHECK(database.run("BEGIN IMMEDIATE"));
    RELIEF_TRY(data_version, database.integer("PRAGMA data_version"));
    return {};
  }

  /// When another writer was quicker, the next transaction says so.
  void keep_others_out() const {
    if (!database.run("BEGIN IMMEDIATE")) database.roll_back();
  }

  /// Runs `change` in a transaction of its own; what it wrote is on disk on return, or nothing of it is left.
  template <typename Change>
  [[nodiscard]] Status transaction(Change&& change) {
    if (read_only) return database.failure(Errc::Io, "was opened for reading only");
    if (!database.in_transaction()) {
      RELIEF_CHECK(database.run("BEGIN IMMEDIATE"));
      const auto version = database.integer("PRAGMA data_version");
      if (!version || *version != data_version) {
        database.roll_back();
        return changed_by_another();
      }
    }
    Status done = change();
    if (done) done = database.run("COMMIT");
    database.roll_back();
    keep_others_out();
    return done;
  }

  /// Runs `read` on the rows as they were when the file was opened.
  template <typename Read>
  [[nodiscard]] auto reading(Read&& read) const -> decltype(read()) {
    if (database.in_transaction()) return read();
    RELIEF_CHECK(database.run("BEGIN"));
    const auto version = database.integer("PRAGMA data_version");
    auto found = version && *version == data_version ? read() : decltype(read())(changed_by_another());
    database.roll_back();
    return found;
  }
  /// That no stroke up to this one lacks rows.
  [[nodiscard]] Status check_complete(std::int64_t stroke) const {
    if (stroke < incomplete) return {};
    return database.damaged("changes of stroke " + std::to_string(incomplete) + " are missing");
  }
  [[nodiscard]] std::unexpected<Error> changed_by_another() const {
    return database.failure(Errc::Io, "was changed by another program: open it again");
  }

  [[nodiscard]] Status read(const Progress& progress);
  /// The model at a stroke and the layers that it has, near one of which they are known.
  struct Place {
    SnapshotPtr snapshot;
    LayerTable layers;
  };
  [[nodiscard]] Result<Place> state_at(std::int64_t stroke, const Place& near, std::int64_t near_stroke,
                                       const Progress& progress) const;
  [[nodiscard]] std::unexpected<Error> cannot_go(std::int64_t stroke, const Error& why, const Progress& progress) const;
  [[nodiscard]] Result<std::uint64_t> move_to(std::int64_t stroke, const Progress& progress);
};

ModelFile::ModelFile(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
ModelFile::ModelFile(ModelFile&&) noexcept = default;
ModelFile& ModelFile::operator=(ModelFile&&) noexcept = default;
ModelFile::~ModelFile() = default;

Result<ModelFile> ModelFile::create(const std::filesystem::path& file, const Model& model, const Progress& progress) {
  RELIEF_ASSERT(model.head != nullptr);
  const auto refuse = [&](const std::string& why) {
    return fail(Errc::InvalidArgument, "'" + printable(file.string()) + "' is not written: " + why);
  };
  if (const Status sound = validate(*model.head); !sound) return refuse(sound.error().message);
  if (!std::isfinite(model.info.source_diagonal) || model.info.source_diagonal < 0)
    return refuse("the source's diagonal is not a length");

  std::optional<State> made;
  {
    RELIEF_TRY(Replacement replacement, Replacement::make(file, kKind));
    {
      RELIEF_TRY(ModelFile unsaved, make_unsaved(replacement.file(), file, model, progress));
      made = State{.database = {}, .meta = unsaved.state_->meta, .layers = unsaved.state_->layers, .model = model};
    }
    RELIEF_CHECK(replacement.replace_target());
  }
  RELIEF_TRY(made->database, Database::open(file, Database::Access::Write, kKind));
  RELIEF_CHECK(made->lock());
  return ModelFile(std::make_unique<State>(*std::move(made)));
}

Result<ModelFile> ModelFile::make_unsaved(const std::filesystem::path& place, const std::filesystem::path& named,
                                          const Model& model, const Progress& progress) {
  RELIEF_TRY(Database database, Database::open(place, Database::Access::Write, kKind, named));
  auto state = std::make_unique<State>(
      State{.database = std::move(database), .meta = meta_of(model), .layers = layers_of(*model.head), .model = model});
  RELIEF_CHECK(write_model(state->database, model, state->meta, state->layers, progress));
  RELIEF_TRY(state->data_version, state->database.integer("PRAGMA data_version"));
  return ModelFile(std::move(state));
}

Result<ModelFile> ModelFile::open(const std::filesystem::path& file, bool read_only, const Progress& progress) {
  RELIEF_TRY(Database database,
             Database::open(file, read_only ? Database::Access::Read : Database::Access::Write, kKind));
  auto state = std::make_unique<State>(State{.database = std::move(database), .read_only = read_only});
  if (Status read = state->read(progress); !read) {
    if (read.error().code == Errc::Corrupt)
      read.error().message += "; relief info MODEL --salvage -o OUT.relief writes what is whole";
    return std::unexpected(std::move(read).error());
  }
  return ModelFile(std::move(state));
}

Status ModelFile::State::read(const Progress& progress) {
  const Database::Cancellable cancellable(database, progress);
  const Rows rows(database);
  progress("open", 0);
  RELIEF_CHECK(database.check_format());  // before anything is changed in what may be somebody else's database
  if (read_only) {
    RELIEF_CHECK(database.run("BEGIN"));
    RELIEF_TRY(data_version, database.integer("PRAGMA data_version"));
  } else {
    RELIEF_CHECK(lock());
  }
  RELIEF_CHECK(database.check_tables());
  RELIEF_TRY(meta, rows.read_meta());
  RELIEF_TRY(incomplete, rows.first_incomplete(meta));
  RELIEF_CHECK(check_complete(meta.current));
  RELIEF_TRY(const auto mesh, rows.read_cage(meta));
  RELIEF_TRY(layers, rows.read_layers(meta.current, meta.format));
  RELIEF_TRY(model.head, load(rows, mesh, layers, meta.current, progress));
  model.info = meta.info;
  if (read_only) database.roll_back();
  return {};
}

Status ModelFile::copy(const std::filesystem::path& from, const std::filesystem::path& to, const Progress& progress) {
  RELIEF_TRY(const Database source, Database::open(from, Database::Access::Read, kKind));
  {
    const Database::Cancellable cancellable(source, progress);
    RELIEF_CHECK(source.check_format());
    RELIEF_CHECK(source.check_tables());
  }
  std::error_code code;
  if (std::filesystem::equivalent(from, to, code)) return {};
  RELIEF_TRY(Replacement replacement, Replacement::make(to, kKind));
  {
    RELIEF_TRY(const Database database, Database::open(replacement.file(), Database::Access::Write, kKind, to));
    RELIEF_CHECK(database.run("PRAGMA journal_mode = MEMORY"));
    RELIEF_CHECK(database.run("PRAGMA synchronous = OFF"));
    RELIEF_CHECK(database.copy_from(source, progress));
  }
  return replacement.replace_target();
}

const Model& ModelFile::model() const noexcept { return state_->model; }
std::string ModelFile::doubt(const Progress& progress) const {
  return doubt_about(state_->model.head->slab_mesh(), state_->meta.info.mode, state_->meta.certificate, progress);
}
std::uint64_t ModelFile::stroke_count() const noexcept { return static_cast<std::uint64_t>(state_->meta.current); }
std::uint64_t ModelFile::redo_count() const noexcept {
  return static_cast<std::uint64_t>(state_->meta.last - state_->meta.current);
}

Result<std::vector<StrokeRecord>> ModelFile::strokes() const {
  return Rows(state_->database).read_strokes(state_->meta.last);
}

Result<std::vector<DamagedStrokes>> ModelFile::damage(const Progress& progress) const {
  const State& state = *state_;
  const Database::Cancellable cancellable(state.database, progress);
  RELIEF_TRY(const detail::HistoryCheck check, state.reading([&] {
    return detail::check_history(state.database, state.database, true, state.meta.last, progress);
  }));
  std::vector<DamagedStrokes> found;
  for (std::uint64_t k = 0; k < check.readable.size(); ++k) {
    if (check.readable[k]) continue;
    if (found.empty() || found.back().last + 1 != k) found.push_back({k, k});
    found.back().last = k;
  }
  return found;
}

Status ModelFile::commit(SnapshotPtr head, const StrokeRecord& stroke, const Progress& progress) {
  RELIEF_ASSERT(head != nullptr);
  State& state = *state_;
  const Snapshot& before = *state.model.head;
  const SlabMesh& mesh = before.slab_mesh();
  const auto refuse = [&](const std::string& why) {
    return state.database.failure(Errc::InvalidArgument, "keeps its last stroke: " + why);
  };
  if (&head->slab_mesh() != &mesh && head->slab_mesh().content_hash() != mesh.content_hash())
    return refuse("the new model stands on another cage");
  if (stroke.label.size() > kMaxText || stroke.details.size() > kMaxText)
    return refuse("the stroke's text is too long");

  const std::int64_t number = state.meta.current + 1;
  LayerTable layers = state.layers;
  std::vector<std::pair<Layer, LayerEntry>> layer_rows;
  std::array<bool, kLayerCount> fresh{};
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto layer = static_cast<Layer>(k);
    if (layer == Layer::Displacement) continue;
    if (!head->has(layer)) {
      if (layers[k]) layer_rows.emplace_back(layer, LayerEntry{.stroke = number, .intervals = kLayerGone});
      layers[k].reset();
      continue;
    }
    const std::int64_t intervals = intervals_of(*head, layer);
    fresh[k] = !layers[k] || layers[k]->intervals != intervals;
    if (!fresh[k]) continue;
    layers[k] = {.stroke = number, .intervals = intervals, .type = type_in_file(layer, state.meta.format)};
    layer_rows.emplace_back(layer, *layers[k]);
  }

  std::vector<PageChange> changes;
  std::uint64_t tiles = 0;
  Status sound;
  for_each_change(before, *head, [&](Layer layer, SlabId s) {
    const bool is_fresh = fresh[static_cast<std::size_t>(layer)];
    if (!sound || (!is_fresh && head->tile(layer, s).same_values(before.tile(layer, s)))) return;
    const SlabId page = s / kTilesPerPage;
    if (changes.empty() || changes.back().layer != layer || changes.back().page != page)
      changes.push_back({layer, page, 0, is_fresh});
    changes.back().tiles |= std::uint64_t{1} << (s % kTilesPerPage);
    ++tiles;
    sound = head->tile(layer, s).intervals() == intervals_of(*layers[static_cast<std::size_t>(layer)], mesh, s)
                ? validate(*head, layer, s)
                : fail(Errc::Corrupt, "a tile of " + std::string(name(layer)) + " has the wrong size");
  });
  if (!sound) return refuse(sound.error().message);

  Meta meta = state.meta;
  meta.current = meta.last = number;
  const StrokeRecord record{static_cast<std::uint64_t>(number), stroke.label, stroke.details, tiles};
  const Rows rows(state.database);
  const auto write = [&]() -> Status {
    if (state.meta.current < state.meta.last) RELIEF_CHECK(rows.drop_strokes_after(state.meta.current));
    for (const auto& [layer, entry] : layer_rows) RELIEF_CHECK(rows.write_layer(layer, entry));
    Steps pages(progress, "save", changes.size());
    for (PageChange& change : changes) {
      if (!pages.next()) return rows.cancelled();
      const LayerEntry& entry = *layers[static_cast<std::size_t>(change.layer)];
      // What the file has as another type was rounded when it was read: a difference would not lead back to it.
      change.whole = change.whole || entry.type != sample_type(change.layer);
      if (!change.whole) {
        RELIEF_TRY(const std::int64_t earlier, rows.changes_since_whole(change.layer, change.page));
        change.whole = earlier >= kWholeEvery;
      }
      RELIEF_CHECK(rows.write_page(change, entry, number, &before, *head));
    }
    RELIEF_CHECK(rows.write_stroke(record, static_cast<std::int64_t>(changes.size() + layer_rows.size())));
    return rows.write_place(meta);
  };
  RELIEF_CHECK(state.transaction(write));
  state.meta = std::move(meta);
  state.layers = layers;
  state.model.head = std::move(head);
  state.incomplete = std::max(state.incomplete, number + 1);
  return {};
}

Result<SnapshotPtr> ModelFile::at(std::uint64_t stroke, const SnapshotPtr& near, std::uint64_t near_stroke,
                                  const Progress& progress) const {
  RELIEF_ASSERT(near != nullptr);
  const State& state = *state_;
  const auto last = static_cast<std::uint64_t>(state.meta.last);
  if (std::max(stroke, near_stroke) > last)
    return state.database.failure(Errc::NotFound, "has no stroke " + std::to_string(std::max(stroke, near_stroke)));
  const Database::Cancellable cancellable(state.database, progress);
  return state.reading([&]() -> Result<SnapshotPtr> {
    State::Place from{near, state.layers};
    if (near_stroke != stroke_count()) {
      RELIEF_TRY(from.layers,
                 Rows(state.database).read_layers(static_cast<std::int64_t>(near_stroke), state.meta.format));
    }
    RELIEF_TRY(State::Place found, state.state_at(static_cast<std::int64_t>(stroke), from,
                                                  static_cast<std::int64_t>(near_stroke), progress));
    return std::move(found.snapshot);
  });
}

Result<SnapshotPtr> ModelFile::at(std::uint64_t stroke, const Progress& progress) const {
  return at(stroke, model().head, stroke_count(), progress);
}

Result<std::uint64_t> ModelFile::undo(std::uint64_t strokes, const Progress& progress) {
  const auto steps = static_cast<std::int64_t>(std::min(strokes, stroke_count()));
  return state_->move_to(state_->meta.current - steps, progress);
}

Result<std::uint64_t> ModelFile::redo(std::uint64_t strokes, const Progress& progress) {
  const auto steps = static_cast<std::int64_t>(std::min(strokes, redo_count()));
  return state_->move_to(state_->meta.current + steps, progress);
}

std::string name_of(const DamagedStrokes& strokes) {
  const auto& [first, last] = strokes;
  if (last == 0) return "the model before its first stroke";
  if (first == 0) return "all up to stroke " + std::to_string(last);
  if (first == last) return "stroke " + std::to_string(first);
  return "strokes " + std::to_string(first) + " to " + std::to_string(last);
}

std::string to_string(const DamagedStrokes& strokes) {
  return name_of(strokes) + (strokes.first > 0 && strokes.first < strokes.last ? " are damaged" : " is damaged");
}

Status ModelFile::go_to(std::uint64_t stroke, SnapshotPtr state_there) {
  RELIEF_ASSERT(state_there != nullptr);
  State& state = *state_;
  if (stroke > static_cast<std::uint64_t>(state.meta.last))
    return state.database.failure(Errc::NotFound, "has no stroke " + std::to_string(stroke));
  Meta meta = state.meta;
  meta.current = static_cast<std::int64_t>(stroke);
  LayerTable layers;
  const auto write = [&]() -> Status {
    const Rows rows(state.database);
    RELIEF_CHECK(state.check_complete(meta.current));
    RELIEF_TRY(layers, rows.read_layers(meta.current, meta.format));
    for (std::size_t k = 0; k < layers.size(); ++k) {
      const auto layer = static_cast<Layer>(k);
      if (state_there->has(layer) != layers[k].has_value() ||
          (layers[k] && intervals_of(*state_there, layer) != layers[k]->intervals))
        return state.database.failure(
            Errc::InvalidArgument, "keeps its place: the model given is not that of stroke " + std::to_string(stroke));
    }
    return rows.write_place(meta);
  };
  RELIEF_CHECK(state.transaction(write));
  state.meta = std::move(meta);
  state.layers = layers;
  state.model.head = std::move(state_there);
  return {};
}

Result<ModelFile::State::Place> ModelFile::State::state_at(std::int64_t stroke, const Place& near,
                                                           std::int64_t near_stroke, const Progress& progress) const {
  const Rows rows(database);
  if (stroke == near_stroke) return near;
  RELIEF_CHECK(check_complete(stroke));
  Place place;
  RELIEF_TRY(place.layers, rows.read_layers(stroke, meta.format));
  if (place.layers == near.layers) {
    RELIEF_TRY(place.snapshot, move(rows, near.snapshot, near.layers, near_stroke, stroke, progress));
  } else {
    RELIEF_TRY(place.snapshot, load(rows, near.snapshot->shared_slab_mesh(), place.layers, stroke, progress));
  }
  return place;
}

/// Says how far undo or redo can go where it cannot go to a stroke.
std::unexpected<Error> ModelFile::State::cannot_go(std::int64_t stroke, const Error& why,
                                                   const Progress& progress) const {
  const auto check = detail::check_history(database, database, true, meta.last, progress);
  if (!check || check->readable[static_cast<std::size_t>(stroke)]) return std::unexpected(why);
  const std::int64_t step = stroke < meta.current ? -1 : 1;
  const auto is = [&](bool readable, std::int64_t k) {
    return k >= 0 && k <= meta.last && check->readable[static_cast<std::size_t>(k)] == readable;
  };
  std::int64_t stop = meta.current;
  while (is(true, stop + step)) stop += step;
  std::int64_t lost = stop + step;
  while (is(false, lost + step)) lost += step;
  const auto [first, last] = std::minmax({stop + step, lost});
  return database.failure(
      Errc::Corrupt, "stays at stroke " + std::to_string(meta.current) + ": " +
                         to_string({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last)}) + ", and " +
                         (step < 0 ? "undo" : "redo") + " stops at stroke " + std::to_string(stop));
}

Result<std::uint64_t> ModelFile::State::move_to(std::int64_t stroke, const Progress& progress) {
  const Database::Cancellable cancellable(database, progress);
  Meta moved_meta = meta;
  moved_meta.current = stroke;
  Place there;
  const auto write = [&]() -> Status {
    if (stroke == meta.current) return {};
    auto found = state_at(stroke, {model.head, layers}, meta.current, progress);
    if (!found)
      return found.error().code == Errc::Corrupt ? cannot_go(stroke, found.error(), progress)
                                                 : std::unexpected(found.error());
    there = *std::move(found);
    return Rows(database).write_place(moved_meta);
  };
  RELIEF_CHECK(transaction(write));
  const std::int64_t steps = stroke - meta.current;
  if (steps != 0) {
    meta = std::move(moved_meta);
    layers = there.layers;
    model.head = std::move(there.snapshot);
  }
  return static_cast<std::uint64_t>(steps < 0 ? -steps : steps);
}

}  // namespace relief
