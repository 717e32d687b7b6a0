// Salvage: the rows of a damaged model that hold become a model file of their own, from which its states are read.
#include <relief/base/try.h>
#include <relief/file/checksum.h>
#include <relief/file/history_check.h>
#include <relief/file/model_file.h>
#include <relief/file/model_rows.h>

#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace relief {

namespace {

using detail::Bytes;
using detail::Database;
using detail::HistoryCheck;
using detail::Meta;
using detail::Replacement;
using detail::Statement;

constexpr const char* kNothing = "is damaged where it matters, and nothing can be salvaged: ";

Status bind_column(Statement& put, const Statement& row, int column) {
  switch (row.type(column)) {
    case Statement::Type::Integer:
      put.bind(row.integer(column));
      return {};
    case Statement::Type::Text:
      put.bind(row.text(column));
      return {};
    case Statement::Type::Blob:
      put.bind(row.blob(column));
      return {};
    default:
      return fail(Errc::Corrupt, "no row of ours holds this");
  }
}

bool cage_holds(const Statement& row) { return row.integer(1) == detail::hash_of(row.text(0), row.blob(2)); }

/// Copies the rows that hold into an empty model file.
Status copy_rows(const Database& from, const Database& to, const Progress& progress) {
  struct Table {
    const char *select, *order, *insert;
    int columns;
    bool (*holds)(const Statement&);
  };
  for (const Table& table :
       {Table{"SELECT * FROM cage NOT INDEXED", "rowid", "INSERT OR IGNORE INTO cage VALUES(?, ?, ?)", 3, cage_holds},
        Table{"SELECT * FROM layers NOT INDEXED", "rowid", "INSERT OR IGNORE INTO layers VALUES(?, ?, ?, ?)", 4,
              detail::layer_holds},
        Table{"SELECT * FROM pages NOT INDEXED", "rowid", "INSERT OR IGNORE INTO pages VALUES(?, ?, ?, ?, ?, ?, ?)", 7,
              detail::page_holds},
        Table{"SELECT * FROM strokes", "number", "INSERT OR IGNORE INTO strokes VALUES(?, ?, ?, ?, ?, ?)", 6,
              detail::stroke_holds}}) {
    RELIEF_TRY(Statement put, to.prepare(table.insert));
    RELIEF_CHECK(detail::scan(from, table.select, table.order, [&](const Statement& row) -> Status {
      if (progress.cancelled()) return to.cancelled();
      if (!table.holds(row)) return {};
      put.reset();
      for (int column = 0; column < table.columns; ++column)
        if (!bind_column(put, row, column)) return {};
      return put.run();
    }));
  }
  return {};
}

/// The facts as they read, where they fail their checksum: what does not read is what claims least.
struct Facts {
  Meta meta;
  bool hold = true;
};
Result<Facts> facts_of(const Database& source, std::int64_t fibres, std::int64_t slabs) {
  if (const auto meta = detail::read_meta(source)) return Facts{.meta = *meta};
  std::map<std::string, std::int64_t, std::less<>> integers;
  std::map<std::string, std::string, std::less<>> texts;
  double diagonal = 0;
  RELIEF_CHECK(detail::scan(source, "SELECT key, value FROM meta NOT INDEXED", "rowid", [&](const Statement& row) {
    const std::string key(row.text(0));
    if (row.type(1) == Statement::Type::Integer) integers[key] = row.integer(1);
    if (row.type(1) == Statement::Type::Text) texts[key] = row.text(1);
    if (row.type(1) == Statement::Type::Real) diagonal = row.real(1);
    return Status();
  }));
  Meta meta{.format = integers["format"],
            .info = {.mode = mode_from_name(texts["mode"]).value_or(Mode::Preview),
                     .unit = unit_from_name(texts["unit"]).value_or(Unit::Millimetre),
                     .source = texts["source"],
                     .source_diagonal = std::isfinite(diagonal) && diagonal > 0 ? diagonal : 0},
            .fibres = fibres,
            .slabs = slabs,
            .current = integers["current"],
            .last = integers["last"],
            .certificate = texts["certificate"]};
  // How samples are packed hangs on the format, which stands in the file twice; the checksum tells which is right.
  const auto header = source.integer("PRAGMA user_version");
  for (const std::int64_t format : {meta.format, header.value_or(0)}) {
    meta.format = format;
    if (meta.checksum() == integers["checksum"] && format >= 1 && format <= kFormatVersion) return Facts{.meta = meta};
  }
  if (integers["format"] != meta.format || meta.format < 1 || meta.format > kFormatVersion)
    return source.failure(Errc::Corrupt, std::string(kNothing) + "its format is not known");
  return Facts{.meta = meta, .hold = false};
}

/// How many values of so many bytes the part of the cage holds, from its blob alone; 0 where it is lost.
Result<std::int64_t> cage_count(const Database& rows, std::string_view part, std::size_t bytes) {
  RELIEF_TRY(Statement get, rows.prepare("SELECT data FROM cage WHERE part = ?"));
  RELIEF_TRY(const bool found, get.bind(part).step());
  if (!found) return 0;
  const auto size = ZSTD_getFrameContentSize(get.blob(0).data(), get.blob(0).size());
  return size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN ? 0
                                                                            : static_cast<std::int64_t>(size / bytes);
}

/// Gives each stroke a record that says as many rows as there are. Returns the strokes whose own is lost.
Result<std::vector<std::uint64_t>> mend_records(const Database& rows, std::int64_t last) {
  std::map<std::int64_t, std::int64_t> found, wrote;
  std::map<std::int64_t, StrokeRecord> records;
  RELIEF_TRY(Statement counts, rows.prepare("SELECT stroke, count(*) FROM (SELECT stroke FROM pages UNION ALL SELECT "
                                            "stroke FROM layers) GROUP BY stroke"));
  for (;;) {
    RELIEF_TRY(const bool row, counts.step());
    if (!row) break;
    found[counts.integer(0)] = counts.integer(1);
  }
  RELIEF_TRY(Statement strokes, rows.prepare("SELECT * FROM strokes"));
  for (;;) {
    RELIEF_TRY(const bool row, strokes.step());
    if (!row) break;
    wrote[strokes.integer(0)] = strokes.integer(4);
    records[strokes.integer(0)] = {.number = static_cast<std::uint64_t>(strokes.integer(0)),
                                   .label = std::string(strokes.text(1)),
                                   .details = std::string(strokes.text(2)),
                                   .tiles = static_cast<std::uint64_t>(strokes.integer(3))};
  }
  std::vector<std::uint64_t> lost;
  RELIEF_CHECK(rows.run("DELETE FROM strokes"));
  for (std::int64_t stroke = 0; stroke <= last; ++stroke) {
    const auto number = static_cast<std::uint64_t>(stroke);
    if (!records.contains(stroke) && stroke > 0) lost.push_back(number);
    StrokeRecord& record = records[stroke];
    record.number = number;
    RELIEF_CHECK(detail::write_stroke(rows, record, found[stroke]));
  }
  return lost;
}

/// The stroke to take: the current one where it is whole, else the newest before it, else the first after it.
std::optional<std::int64_t> newest_whole(const std::vector<bool>& readable, std::int64_t current) {
  const auto last = static_cast<std::int64_t>(readable.size()) - 1;
  for (std::int64_t k = std::min(current, last); k >= 0; --k)
    if (readable[static_cast<std::size_t>(k)]) return k;
  for (std::int64_t k = current + 1; k <= last; ++k)
    if (readable[static_cast<std::size_t>(k)]) return k;
  return std::nullopt;
}

/// Runs of strokes that are, or are not, readable, outside of `first` to `last`.
std::vector<DamagedStrokes> runs(const std::vector<bool>& readable, bool wanted, const Salvaged& kept) {
  std::vector<DamagedStrokes> found;
  for (std::uint64_t k = 0; k < readable.size(); ++k) {
    if (readable[k] != wanted || (k >= kept.first && k <= kept.last)) continue;
    if (found.empty() || found.back().last + 1 != k) found.push_back({k, k});
    found.back().last = k;
  }
  return found;
}

}  // namespace

/// A model file of the rows that hold, which vanishes with it.
struct ModelFile::Rescued {
  Replacement place;
  Meta meta;
  HistoryCheck check;
  std::vector<std::uint64_t> unnamed;  ///< strokes whose records are lost
  bool facts_hold = true;

  [[nodiscard]] static Result<Rescued> from(const std::filesystem::path& file, const std::filesystem::path& beside,
                                            const Progress& progress);
  /// Opened at a stroke.
  [[nodiscard]] Result<ModelFile> open_at(std::int64_t stroke, const Progress& progress);
};

Result<ModelFile::Rescued> ModelFile::Rescued::from(const std::filesystem::path& file,
                                                    const std::filesystem::path& beside, const Progress& progress) {
  RELIEF_TRY(const Database source, Database::open(file, Database::Access::Damaged, detail::model_kind()));
  const Database::Cancellable cancellable(source, progress);
  progress("salvage", 0);
  bool tables_hold = true;
  for (const Status& checked : {source.check_format(), source.check_tables()}) {
    if (!checked && checked.error().code != Errc::Corrupt) return std::unexpected(checked.error());
    tables_hold = tables_hold && checked;
  }
  RELIEF_TRY(Replacement place, Replacement::make(beside, detail::model_kind()));
  RELIEF_TRY(const Database rows, Database::open(place.file(), Database::Access::Write, detail::model_kind(), file));
  RELIEF_CHECK(rows.run("PRAGMA journal_mode = OFF"));
  RELIEF_CHECK(rows.run("PRAGMA synchronous = OFF"));
  RELIEF_CHECK(rows.run("BEGIN"));
  RELIEF_CHECK(rows.write_tables());
  progress("salvage", 0.1);
  RELIEF_CHECK(copy_rows(source, rows, progress));
  RELIEF_TRY(const std::int64_t fibres, cage_count(rows, "fibres", detail::kFibreBytes));
  RELIEF_TRY(const std::int64_t slabs, cage_count(rows, "slabs", detail::kSlabBytes));
  if (fibres == 0 || slabs == 0) return source.failure(Errc::Corrupt, std::string(kNothing) + "its cage is lost");
  RELIEF_TRY(Facts facts, facts_of(source, fibres, slabs));
  progress("salvage", 0.3);
  RELIEF_TRY(HistoryCheck check,
             detail::check_history(source, tables_hold, facts.hold ? facts.meta.last : -1, progress));
  facts.meta.last = check.last();
  if (!facts.hold) facts.meta.current = check.last();
  RELIEF_TRY(std::vector<std::uint64_t> unnamed, mend_records(rows, check.last()));
  RELIEF_CHECK(rows.run("PRAGMA user_version = " + std::to_string(facts.meta.format)));
  RELIEF_CHECK(rows.run("COMMIT"));
  return Rescued{.place = std::move(place),
                 .meta = std::move(facts.meta),
                 .check = std::move(check),
                 .unnamed = std::move(unnamed),
                 .facts_hold = facts.hold};
}

Result<ModelFile> ModelFile::Rescued::open_at(std::int64_t stroke, const Progress& progress) {
  {
    RELIEF_TRY(const Database rows, Database::open(place.file(), Database::Access::Write, detail::model_kind()));
    RELIEF_CHECK(rows.run("PRAGMA synchronous = OFF"));
    Meta there = meta;
    there.current = stroke;
    RELIEF_CHECK(detail::write_meta(rows, there));
  }
  return ModelFile::open(place.file(), true, progress);
}

Result<Salvaged> ModelFile::salvage(const std::filesystem::path& from, const std::filesystem::path& to,
                                    const Progress& progress) {
  std::error_code code;
  if (std::filesystem::equivalent(from, to, code))
    return fail(Errc::InvalidArgument, "'" + printable(to.string()) +
                                           "' is the damaged model itself: choose another name for what is salvaged");
  RELIEF_TRY(Rescued rescued, Rescued::from(from, to, progress));
  std::vector<bool>& readable = rescued.check.readable;
  const auto is_whole = [&](std::int64_t k) {
    return k >= 0 && k <= rescued.check.last() && readable[static_cast<std::size_t>(k)];
  };
  // Only what somebody forged holds its checksums and cannot be read; then the next best is tried.
  Status reason = fail(Errc::Corrupt, "no stroke is whole");
  const auto give_up_on = [&](std::int64_t stroke, const Error& error) -> Status {
    if (error.code != Errc::Corrupt) return std::unexpected(error);
    readable[static_cast<std::size_t>(stroke)] = false;
    reason = std::unexpected(error);
    return {};
  };
  while (const auto newest = newest_whole(readable, rescued.meta.current)) {
    auto source = rescued.open_at(*newest, progress);
    if (!source) {
      RELIEF_CHECK(give_up_on(*newest, source.error()));
      continue;
    }
    std::int64_t first = *newest, last = *newest;
    while (is_whole(first - 1)) --first;
    while (is_whole(last + 1)) ++last;
    auto head = source->at(static_cast<std::uint64_t>(first), progress);
    if (!head) {
      RELIEF_CHECK(give_up_on(first, head.error()));
      continue;
    }
    RELIEF_TRY(const std::vector<StrokeRecord> records, source->strokes());
    Model model{.info = source->model().info, .head = *head};
    if (!(model.info.source_diagonal > 0)) model.info.source_diagonal = diagonal(model.head->slab_mesh().bounds());
    RELIEF_TRY(Replacement replacement, Replacement::make(to, detail::model_kind()));
    std::optional<std::int64_t> unreadable;
    {
      RELIEF_TRY(ModelFile saved, make_unsaved(replacement.file(), to, model, progress));
      SnapshotPtr current = first == *newest ? *head : nullptr;
      for (std::int64_t k = first + 1; k <= last && !unreadable; ++k) {
        progress("salvage", 0.5 + 0.5 * static_cast<double>(k - first) / static_cast<double>(last - first));
        auto next = source->at(static_cast<std::uint64_t>(k), *head, static_cast<std::uint64_t>(k - 1), progress);
        if (!next) {
          RELIEF_CHECK(give_up_on(k, next.error()));
          unreadable = k;
          break;
        }
        RELIEF_CHECK(saved.commit(*next, records[static_cast<std::size_t>(k - 1)], progress));
        head = std::move(next);
        if (k == *newest) current = *head;
      }
      if (!unreadable && last != *newest)
        RELIEF_CHECK(saved.go_to(static_cast<std::uint64_t>(*newest - first), current));
    }
    if (unreadable) continue;
    RELIEF_CHECK(replacement.replace_target());
    Salvaged kept{.first = static_cast<std::uint64_t>(first),
                  .current = static_cast<std::uint64_t>(*newest),
                  .last = static_cast<std::uint64_t>(last)};
    for (const DamagedStrokes& run : runs(readable, false, kept)) kept.lost.push_back(name_of(run) + " (damaged)");
    for (const DamagedStrokes& run : runs(readable, true, kept))
      kept.lost.push_back(name_of(run) + " (cut off by that)");
    for (const std::uint64_t stroke : rescued.unnamed)
      if (stroke > kept.first && stroke <= kept.last)
        kept.lost.push_back("the label and text of stroke " + std::to_string(stroke));
    if (!rescued.facts_hold) kept.lost.emplace_back("which stroke was current; mode, unit and source are as they read");
    return kept;
  }
  return fail(Errc::Corrupt, "'" + printable(from.string()) + "' " + kNothing + reason.error().message);
}

}  // namespace relief
