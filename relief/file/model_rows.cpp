#include <relief/base/hash.h>
#include <relief/base/try.h>
#include <relief/file/checksum.h>
#include <relief/file/history_check.h>
#include <relief/file/model_rows.h>
#include <relief/file/tile_codec.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>

namespace relief::detail {

namespace {

constexpr std::int64_t kApplicationId = 0x524c4631;  // "RLF1"

constexpr std::array<FileKind::Table, 5> kTables = {{
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
constexpr FileKind kKind = {
    .suffix = ".relief", .application_id = kApplicationId, .newest_format = kFormatVersion, .tables = kTables};

std::int64_t hash_of(const StrokeRecord& s, std::int64_t row_count) {
  return detail::hash_of(s.label, bytes_of(s.details), s.number, s.tiles, row_count);
}

StrokeRecord record_in(const Statement& row) {
  return {.number = static_cast<std::uint64_t>(row.integer(0)),
          .label = std::string(row.text(1)),
          .details = std::string(row.text(2)),
          .tiles = static_cast<std::uint64_t>(row.integer(3))};
}

}  // namespace

const FileKind& model_kind() noexcept { return kKind; }

std::int64_t Meta::checksum() const {
  Hash64 hash;
  for (const std::int64_t number :
       {format, fibres, slabs, current, last, static_cast<std::int64_t>(info.mode),
        static_cast<std::int64_t>(info.unit), std::bit_cast<std::int64_t>(info.source_diagonal)})
    hash.add(static_cast<std::uint64_t>(number));
  hash.add_bytes(bytes_of(info.source));
  hash.add_bytes(bytes_of(certificate));
  if (float_colours) hash.add(1U);
  if (first_sculpted) hash.add(2U);
  return stored(hash);
}

Meta Meta::upgraded() const {
  Meta meta = *this;
  meta.format = kFormatVersion;
  meta.float_colours = float_colours || format < 3;
  return meta;
}

std::int64_t intervals_entry(Layer layer, const Grid& grid) noexcept {
  return has_own_intervals(layer) ? kOwnIntervals : is_uniform(grid) ? std::int64_t{grid.front()} : kEachItsOwn;
}

SampleType type_in_file(Layer layer, const Meta& meta) noexcept {
  return meta.format < 3 || meta.float_colours ? SampleType::F32 : sample_type(layer);
}

PageLayout::PageLayout(const Grid& grid, Layer layer, SampleType type, SlabId page, std::uint64_t tiles) : mask(tiles) {
  for (SlabId t = 0; t < kTilesPerPage; ++t) {
    begin[t + 1] = begin[t];
    if (has(t)) begin[t + 1] += tile_bytes(layer, grid[page * kTilesPerPage + t], type);
  }
}

// ---- Writing

Status Rows::write_meta(const Meta& meta) const {
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
  if (meta.float_colours) RELIEF_CHECK(write("float_colours", std::int64_t{1}));
  if (meta.first_sculpted) RELIEF_CHECK(write("first_sculpted", std::int64_t{1}));
  return write_place(meta, put);
}

Status Rows::write_place(const Meta& meta) const {
  RELIEF_TRY(Statement put, database_.prepare("INSERT OR REPLACE INTO meta VALUES(?, ?)"));
  return write_place(meta, put);
}

Status Rows::write_place(const Meta& meta, Statement& put) const {
  const auto write = [&](std::string_view key, std::int64_t value) {
    put.reset();
    return put.bind(key).bind(value).run();
  };
  RELIEF_CHECK(write("current", meta.current));
  RELIEF_CHECK(write("last", meta.last));
  return write("checksum", meta.checksum());
}

Status Rows::write_layer(Layer layer, const LayerEntry& entry) const {
  RELIEF_TRY(Statement put, database_.prepare("INSERT INTO layers VALUES(?, ?, ?, ?)"));
  return put.bind(name(layer))
      .bind(entry.stroke)
      .bind(entry.intervals)
      .bind(detail::hash_of(name(layer), {}, entry.stroke, entry.intervals))
      .run();
}

Status Rows::write_page(const PageChange& change, SampleType type, std::int64_t stroke,
                        const std::function<const Tile&(SlabId)>& before, const Snapshot& now) const {
  const std::uint64_t mask = change.whole ? all_tiles(now.slab_mesh().slab_count(), change.page) : change.tiles;
  std::vector<std::byte> raw, old;
  for (SlabId t = 0; t < kTilesPerPage; ++t) {
    if ((mask >> t & 1U) == 0) continue;
    const SlabId s = change.page * kTilesPerPage + t;
    const Tile& tile = now.tile(change.layer, s);
    const std::size_t begin = raw.size();
    raw.resize(begin + tile_bytes(change.layer, tile.intervals(), type));
    const auto samples = std::span(raw).subspan(begin);
    copy_samples(tile, type, samples);
    if (change.whole) continue;
    old.resize(samples.size());
    copy_samples(before(s), type, old);
    exclusive_or(samples, old);
  }
  const std::vector<std::byte> blob = pack(raw, bytes(type));
  const std::int64_t whole = change.whole ? 1 : 0;
  const auto tiles = std::bit_cast<std::int64_t>(mask);
  RELIEF_TRY(Statement put, database_.prepare("INSERT INTO pages VALUES(?, ?, ?, ?, ?, ?, ?)"));
  return put.bind(name(change.layer))
      .bind(std::int64_t{change.page})
      .bind(stroke)
      .bind(whole)
      .bind(tiles)
      .bind(detail::hash_of(name(change.layer), blob, change.page, stroke, whole, tiles))
      .bind(Bytes(blob))
      .run();
}

Status Rows::write_stroke(const StrokeRecord& stroke, std::int64_t row_count) const {
  RELIEF_TRY(Statement put, database_.prepare("INSERT INTO strokes VALUES(?, ?, ?, ?, ?, ?)"));
  return put.bind(static_cast<std::int64_t>(stroke.number))
      .bind(std::string_view(stroke.label))
      .bind(std::string_view(stroke.details))
      .bind(static_cast<std::int64_t>(stroke.tiles))
      .bind(row_count)
      .bind(hash_of(stroke, row_count))
      .run();
}

Status Rows::drop_strokes_after(std::int64_t stroke) const {
  for (const char* sql : {"DELETE FROM pages WHERE stroke > ?", "DELETE FROM layers WHERE stroke > ?",
                          "DELETE FROM strokes WHERE number > ?"}) {
    RELIEF_TRY(Statement drop, database_.prepare(sql));
    RELIEF_CHECK(drop.bind(stroke).run());
  }
  return cage_.drop_after(stroke);
}

Result<std::int64_t> Rows::changes_since_whole(Layer layer, SlabId page) const {
  RELIEF_TRY(Statement count,
             database_.prepare("SELECT count(*) FROM pages WHERE layer = ?1 AND page = ?2 AND stroke > (SELECT "
                               "ifnull(max(stroke), -1) FROM pages WHERE layer = ?1 AND page = ?2 AND whole = 1)"));
  RELIEF_TRY(const bool row, count.bind(name(layer)).bind(std::int64_t{page}).step());
  return row ? count.integer(0) : 0;
}

// ---- Reading

Result<Meta> Rows::read_meta() const {
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
            .certificate = texts["certificate"],
            .float_colours = integers["float_colours"] != 0,
            .first_sculpted = integers["first_sculpted"] != 0};
  if (meta.checksum() != integers["checksum"]) return damaged("its facts fail their checksum");
  RELIEF_TRY(const std::int64_t version, database_.integer("PRAGMA user_version"));
  if (meta.format != version || meta.fibres < 3 || meta.slabs < 1 || meta.slabs > std::int64_t{1} << 30 ||
      meta.fibres > 3 * meta.slabs || meta.current < 0 || meta.current > meta.last ||
      !std::isfinite(meta.info.source_diagonal) || meta.info.source_diagonal < 0)
    return damaged("its facts do not make sense");
  return meta;
}

Result<LayerTable> Rows::read_layers(std::int64_t stroke, const Meta& meta) const {
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
    lost[k] = !layer_holds(rows);
    if (lost[k]) continue;
    const LayerEntry entry{.stroke = rows.integer(1), .intervals = rows.integer(2), .type = type_in_file(*layer, meta)};
    const bool sound = *layer == Layer::Displacement    ? entry.intervals == kOwnIntervals && entry.stroke == 0
                       : entry.intervals == kLayerGone  ? true
                       : has_own_intervals(*layer)      ? entry.intervals == kOwnIntervals
                       : entry.intervals == kEachItsOwn ? true
                                                        : entry.intervals >= 1 && entry.intervals <= kMaxIntervals;
    if (!sound || entry.stroke < 0) return damaged("its layers do not make sense");
    table[k] = entry.intervals == kLayerGone ? std::nullopt : std::optional(entry);
  }
  if (std::ranges::find(lost, true) != lost.end()) return damaged("its layers fail their checksum");
  if (!table[static_cast<std::size_t>(Layer::Displacement)]) return damaged("it has no displacement");
  return table;
}

Result<std::vector<std::int64_t>> Rows::layer_strokes(std::int64_t after, std::int64_t last) const {
  std::vector<std::int64_t> strokes;
  RELIEF_TRY(Statement rows,
             database_.prepare("SELECT DISTINCT stroke FROM layers WHERE stroke > ? AND stroke <= ? ORDER BY stroke"));
  rows.bind(after).bind(last);
  for (;;) {
    RELIEF_TRY(const bool row, rows.step());
    if (!row) return strokes;
    strokes.push_back(rows.integer(0));
  }
}

Result<Rows::PageRow> Rows::page_row(const Statement& row, Layer layer, SlabId page) const {
  if (!page_holds(row)) return page_damage(layer, page, row.integer(2), "fails its checksum");
  return PageRow{.stroke = row.integer(2),
                 .whole = row.integer(3) != 0,
                 .tiles = std::bit_cast<std::uint64_t>(row.integer(4)),
                 .data = row.blob(6)};
}

Result<std::vector<Rows::PageKey>> Rows::page_keys(std::int64_t after, std::int64_t last) const {
  std::vector<PageKey> keys;
  RELIEF_TRY(Statement rows,
             database_.prepare("SELECT layer, page, stroke FROM pages WHERE stroke > ? AND stroke <= ?"));
  rows.bind(after).bind(last);
  for (;;) {
    RELIEF_TRY(const bool row, rows.step());
    if (!row) break;
    const auto layer = layer_from_name(rows.text(0));
    if (!layer || rows.integer(1) < 0 || rows.integer(1) >= kNoSlab) return damaged("it has a page of nothing");
    keys.push_back({.stroke = rows.integer(2), .layer = *layer, .page = static_cast<SlabId>(rows.integer(1))});
  }
  std::ranges::stable_sort(keys, {}, &PageKey::stroke);
  return keys;
}

Result<std::vector<StrokeRecord>> Rows::read_strokes(std::int64_t last) const {
  std::vector<StrokeRecord> strokes;
  RELIEF_TRY(Statement rows,
             database_.prepare("SELECT number, label, details, tiles, row_count, hash FROM strokes WHERE number "
                               "BETWEEN 1 AND ? ORDER BY number"));
  rows.bind(last);
  for (;;) {
    RELIEF_TRY(const bool row, rows.step());
    if (!row) break;
    if (stroke_holds(rows))
      strokes.push_back(record_in(rows));
    else
      strokes.push_back({.number = static_cast<std::uint64_t>(rows.integer(0)), .damaged = true});
  }
  if (strokes.size() != static_cast<std::size_t>(last)) return damaged("its journal of strokes has a gap");
  return strokes;
}

Result<PageLayout> Rows::unpack_row(const PageRow& row, const LayerEntry& entry, const Grid& grid, Layer layer,
                                    SlabId page, std::vector<std::byte>& samples) const {
  const std::uint64_t allowed = all_tiles(static_cast<SlabId>(grid.size()), page);
  if (row.stroke < entry.stroke || (row.tiles & ~allowed) != 0)
    return page_damage(layer, page, row.stroke, "does not fit the cage");
  const PageLayout layout(grid, layer, entry.type, page, row.tiles);
  if (!may_hold(row.data, layout.bytes())) return page_damage(layer, page, row.stroke, "does not fit the cage");
  samples.resize(layout.bytes());
  if (!unpack(row.data, bytes(entry.type), samples)) return page_damage(layer, page, row.stroke, "cannot be unpacked");
  return layout;
}

Result<std::optional<PageTiles>> Rows::read_differences(const Snapshot& known, Layer layer, const LayerEntry& entry,
                                                        const Grid& grid, SlabId page, std::int64_t after,
                                                        std::int64_t last) const {
  // What the file has as another type was rounded when it was read: a difference would not lead back to it.
  if (entry.type != sample_type(layer)) return std::nullopt;
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
    RELIEF_TRY(const PageLayout changed, unpack_row(*row, entry, grid, layer, page, part));
    for (SlabId t = 0; t < kTilesPerPage; ++t) {
      if (!changed.has(t)) continue;
      const auto difference = changed.tile(Bytes(part), t);
      if (samples[t].empty()) {
        samples[t].resize(difference.size());
        copy_samples(known.tile(layer, page * kTilesPerPage + t), entry.type, samples[t]);
      }
      exclusive_or(samples[t], difference);
    }
  }
  PageTiles tiles;
  for (SlabId t = 0; t < kTilesPerPage; ++t)
    if (!samples[t].empty()) tiles[t] = tile_from(samples[t], entry.type, layer, grid[page * kTilesPerPage + t]);
  return tiles;
}

Result<PageTiles> Rows::read_page(const Grid& grid, Layer layer, const LayerEntry& entry, SlabId page,
                                  std::int64_t stroke) const {
  RELIEF_TRY(Statement rows,
             database_.prepare("SELECT * FROM pages WHERE layer = ?1 AND page = ?2 AND "
                               "stroke <= ?3 AND stroke >= (SELECT max(stroke) FROM pages WHERE layer = ?1 AND page = "
                               "?2 AND stroke <= ?3 AND whole = 1) ORDER BY stroke"));
  rows.bind(name(layer)).bind(std::int64_t{page}).bind(stroke);
  const auto slabs = static_cast<SlabId>(grid.size());
  const PageLayout layout(grid, layer, entry.type, page, all_tiles(slabs, page));
  std::vector<std::byte> all, part;
  for (;;) {
    RELIEF_TRY(const bool more, rows.step());
    if (!more) break;
    RELIEF_TRY(const PageRow row, page_row(rows, layer, page));
    const bool first = all.empty();
    if (row.whole != first || (first && row.tiles != layout.mask))
      return page_damage(layer, page, row.stroke, "does not fit the cage");
    RELIEF_TRY(const PageLayout changed, unpack_row(row, entry, grid, layer, page, part));
    if (first) {
      all.swap(part);
      continue;
    }
    for (SlabId t = 0; t < kTilesPerPage; ++t)
      if (changed.has(t)) exclusive_or(layout.tile(std::span(all), t), changed.tile(Bytes(part), t));
  }
  if (all.empty()) return page_damage(layer, page, stroke, "is missing");
  PageTiles tiles;
  for (SlabId t = 0; t < tiles_in_page(slabs, page); ++t) {
    tiles[t] = tile_from(layout.tile(Bytes(all), t), entry.type, layer, grid[page * kTilesPerPage + t]);
    if (!tiles[t]) return page_damage(layer, page, stroke, "holds values outside its range");
    if (t > 0 && tiles[t]->same_values(*tiles[t - 1])) tiles[t] = tiles[t - 1];
  }
  return tiles;
}

Status Rows::apply_row(const PageKey& key, const Grid& grid, const LayerEntry& entry,
                       std::vector<TilePtr>& tiles) const {
  const auto& [stroke, layer, page] = key;
  RELIEF_TRY(Statement rows, database_.prepare("SELECT * FROM pages WHERE layer = ? AND page = ? AND stroke = ?"));
  RELIEF_TRY(const bool found, rows.bind(name(layer)).bind(std::int64_t{page}).bind(stroke).step());
  const auto slabs = static_cast<SlabId>(grid.size());
  if (!found || page >= pages_for(slabs)) return page_damage(layer, page, stroke, "does not fit the cage");
  RELIEF_TRY(const PageRow row, page_row(rows, layer, page));
  std::vector<std::byte> samples, old;
  RELIEF_TRY(const PageLayout layout, unpack_row(row, entry, grid, layer, page, samples));
  const bool leads_back = row.whole ? row.tiles == all_tiles(slabs, page) : entry.type == sample_type(layer);
  if (!leads_back) return page_damage(layer, page, stroke, "does not fit the cage");
  for (SlabId t = 0; t < kTilesPerPage; ++t) {
    if (!layout.has(t)) continue;
    TilePtr& tile = tiles[page * kTilesPerPage + t];
    const auto part = layout.tile(std::span(samples), t);
    if (!row.whole) {
      if (!tile) return page_damage(layer, page, stroke, "differs from one that is missing");
      old.resize(part.size());
      copy_samples(*tile, entry.type, old);
      exclusive_or(part, old);
    }
    tile = tile_from(part, entry.type, layer, grid[page * kTilesPerPage + t]);
    if (!tile) return page_damage(layer, page, stroke, "holds values outside its range");
  }
  return {};
}

Status Rows::check_pages(Layer layer, const LayerEntry& entry, const Grid& grid, std::int64_t stroke,
                         bool may_need_fewer) const {
  const auto slabs = static_cast<SlabId>(grid.size());
  // Beside max(), the other columns are those of its row.
  RELIEF_TRY(Statement rows, database_.prepare("SELECT page, tiles, length(data), max(stroke) FROM pages WHERE "
                                               "layer = ? AND stroke BETWEEN ? AND ? AND whole = 1 GROUP BY page "
                                               "ORDER BY page"));
  rows.bind(name(layer)).bind(entry.stroke).bind(stroke);
  for (SlabId page = 0; page < pages_for(slabs); ++page) {
    RELIEF_TRY(const bool more, rows.step());
    if (!more || rows.integer(0) != page) return page_damage(layer, page, entry.stroke, "is missing");
    const PageLayout layout(grid, layer, entry.type, page, all_tiles(slabs, page));
    if (std::bit_cast<std::uint64_t>(rows.integer(1)) != layout.mask ||
        layout.bytes() / kMaxExpansion > static_cast<std::size_t>(std::max<std::int64_t>(rows.integer(2), 0)))
      return page_damage(layer, page, rows.integer(3), "does not fit the cage");
  }
  RELIEF_TRY(const bool more, rows.step());
  if (more && !may_need_fewer) return damaged("it has more pages than its cage needs");
  return {};
}

Result<std::int64_t> Rows::first_incomplete(const Meta& meta) const {
  RELIEF_TRY(Statement strokes, database_.prepare("SELECT count(*), min(number), max(number) FROM strokes"));
  RELIEF_TRY(const bool counted, strokes.step());
  if (!counted || strokes.integer(0) != meta.last + 1 || strokes.integer(1) != 0 || strokes.integer(2) != meta.last)
    return damaged("its journal of strokes has a gap");
  RELIEF_TRY(
      Statement short_ones,
      database_.prepare(
          "SELECT number, label, details, tiles, row_count, hash FROM strokes LEFT JOIN (SELECT stroke, "
          "count(*) AS found FROM (SELECT stroke FROM pages UNION ALL SELECT stroke FROM layers UNION ALL SELECT "
          "CAST(part AS INTEGER) FROM cage WHERE part NOT IN ('fibres', 'slabs')) GROUP BY stroke) ON stroke = "
          "number WHERE row_count <> ifnull(found, 0) ORDER BY number"));
  for (;;) {
    RELIEF_TRY(const bool row, short_ones.step());
    if (!row) return meta.last + 1;
    if (stroke_holds(short_ones)) return short_ones.integer(0);
  }
}

std::unexpected<Error> Rows::page_damage(Layer layer, SlabId page, std::int64_t stroke, std::string_view what) const {
  return damaged("page " + std::to_string(page) + " of " + std::string(name(layer)) + " at stroke " +
                 std::to_string(stroke) + " " + std::string(what));
}

}  // namespace relief::detail
