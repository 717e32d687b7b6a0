// Salvage: the rows of a damaged model that hold become a model file of their own, from which its states are read.
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/file/checksum.h>
#include <relief/file/history_check.h>
#include <relief/file/model_file.h>
#include <relief/file/model_rows.h>

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace relief {

namespace {

using detail::Bytes;
using detail::Database;
using detail::HistoryCheck;
using detail::Meta;
using detail::Replacement;
using detail::Statement;

constexpr double kTablesShare = 0.1;  // of the time: SQLite's check of the tables
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

/// Copies the rows that hold into an empty model file.
Status copy_rows(const Database& from, const Database& to, const Progress& progress) {
  struct Table {
    const char *select, *order, *insert;
    int columns;
    bool (*holds)(const Statement&);
  };
  for (const Table& table :
       {Table{"SELECT * FROM cage NOT INDEXED", "rowid", "INSERT OR IGNORE INTO cage VALUES(?, ?, ?)", 3,
              detail::cage_holds},
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
  if (const auto meta = detail::Rows(source).read_meta()) return Facts{.meta = *meta};
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
            .certificate = texts["certificate"],
            .float_colours = integers["float_colours"] != 0,
            .first_sculpted = integers["first_sculpted"] != 0};
  // How samples are packed hangs on the format, which stands in the file twice; the checksum tells which is right.
  const auto header = source.integer("PRAGMA user_version");
  for (const std::int64_t format : {meta.format, header.value_or(0)}) {
    meta.format = format;
    if (meta.checksum() == integers["checksum"] && format >= 1 && format <= kFormatVersion) return Facts{.meta = meta};
  }
  if (integers["format"] != meta.format || meta.format < 1 || meta.format > kFormatVersion)
    return source.failure(Errc::Corrupt, std::string(kNothing) + "its format is not known");
  meta.first_sculpted = true;
  return Facts{.meta = meta, .hold = false};
}

/// Returns how many values of so many bytes the part of the cage holds, from its blob alone; 0 where it is lost.
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
                                            "stroke FROM layers UNION ALL SELECT CAST(part AS INTEGER) FROM cage "
                                            "WHERE part NOT IN ('fibres', 'slabs')) GROUP BY stroke"));
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
    RELIEF_CHECK(detail::Rows(rows).write_stroke(record, found[stroke]));
  }
  return lost;
}

/// Returns the stroke to take: the current one where it is whole, else the newest before it, else the first after it.
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

/// Where the first page is damaged: it says what kind of file this is and where its tables begin, and is the same in
/// every model except for counts that reading does without. So a copy of the file gets the first page of an empty
/// model.
constexpr std::size_t kDatabasePage = 4096;  // bytes; SQLite's own default, with which all our files are made
constexpr std::size_t kPageCount = 28;       // where the first page says how many there are, four bytes, highest first

/// Returns true if one of the two marks of a model is in the first page.
bool may_be_model(std::string_view first_page) {
  constexpr std::string_view kMagic{"SQLite format 3\0", 16};
  const std::int64_t id = detail::model_kind().application_id;
  const std::array<char, 4> mark = {static_cast<char>(id >> 24), static_cast<char>(id >> 16),
                                    static_cast<char>(id >> 8), static_cast<char>(id)};
  return first_page.starts_with(kMagic) || first_page.substr(68, 4) == std::string_view(mark.data(), mark.size());
}

/// Returns the copy; nothing if the file is shorter than a page, or none of ours.
Result<std::optional<Replacement>> with_new_first_page(const std::filesystem::path& file,
                                                       const std::filesystem::path& beside, const Progress& progress) {
  RELIEF_TRY(Replacement copy, Replacement::make(beside, detail::model_kind()));
  {
    RELIEF_TRY(const Database empty, Database::open(copy.file(), Database::Access::Write, detail::model_kind(), file));
    RELIEF_CHECK(empty.run("BEGIN"));
    RELIEF_CHECK(empty.write_tables());
    RELIEF_CHECK(empty.run("COMMIT"));
  }
  std::string page(kDatabasePage, '\0');
  std::fstream to(copy.file(), std::ios::binary | std::ios::in | std::ios::out);
  to.read(page.data(), static_cast<std::streamsize>(page.size()));
  std::ifstream from(file, std::ios::binary);
  std::string block(kDatabasePage * 256, '\0');
  const auto read_block = [&](std::size_t size) {
    from.read(block.data(), static_cast<std::streamsize>(size));
    return static_cast<std::size_t>(from.gcount());
  };
  if (read_block(kDatabasePage) < kDatabasePage || !may_be_model(std::string_view(block).substr(0, kDatabasePage)))
    return std::optional<Replacement>();
  to.seekp(static_cast<std::streamoff>(kDatabasePage));
  std::uint64_t bytes = kDatabasePage;
  while (const std::size_t read = read_block(block.size())) {
    if (progress.cancelled())
      return fail(Errc::Cancelled, "'" + printable(file.string()) + "' is not salvaged: cancelled");
    to.write(block.data(), static_cast<std::streamsize>(read));
    bytes += read;
  }
  for (std::size_t k = 0; k < 4; ++k)
    page[kPageCount + k] = static_cast<char>(static_cast<unsigned char>(bytes / kDatabasePage >> (24 - 8 * k)));
  to.seekp(0);
  to.write(page.data(), static_cast<std::streamsize>(page.size()));
  to.close();
  if (!to) return fail(Errc::Io, "'" + printable(beside.string()) + "' cannot be written: the disk may be full");
  return std::optional(std::move(copy));
}

/// A model file of the rows that hold, which vanishes with it.
struct ModelFile::Rescued {
  Replacement place;
  Meta meta;
  HistoryCheck check;
  std::vector<std::uint64_t> unnamed;  ///< strokes whose records are lost
  bool facts_hold = true;
  std::string reason = "no stroke is whole";  ///< why nothing can be written, if nothing can

  [[nodiscard]] static Result<Rescued> from(const std::filesystem::path& file, const std::filesystem::path& beside,
                                            const Progress& progress);
  [[nodiscard]] static Result<Rescued> from(const Database& source, const std::filesystem::path& beside,
                                            const Progress& progress);
  /// Returns the strokes to write: the newest whole one, and those around it that follow each other.
  [[nodiscard]] std::optional<Salvaged> whole_span() const;
  /// Writes them to a new model. False: the checksums of one hold and it cannot be read nevertheless, as if somebody
  /// had forged it; `check` has it as damaged from now on.
  [[nodiscard]] Result<bool> write(const Salvaged& span, const std::filesystem::path& to, const Progress& progress);
  /// Returns what is not written, clause by clause.
  [[nodiscard]] std::vector<std::string> lost(const Salvaged& span) const;

 private:
  /// Opened at a stroke.
  [[nodiscard]] Result<ModelFile> open_at(std::uint64_t stroke, const Progress& progress);
};

Result<ModelFile::Rescued> ModelFile::Rescued::from(const std::filesystem::path& file,
                                                    const std::filesystem::path& beside, const Progress& progress) {
  progress("salvage", 0);
  RELIEF_TRY(const Database source, Database::open(file, Database::Access::Damaged, detail::model_kind()));
  RELIEF_CHECK(source.run("BEGIN"));  // all that is read is of one moment
  Status known = source.check_format();
  if (known) known = source.check_definitions();
  if (known) return from(source, beside, progress);
  if (known.error().code == Errc::Io) return std::unexpected(known.error());
  RELIEF_TRY(const auto copy, with_new_first_page(file, beside, progress));
  if (!copy) return std::unexpected(known.error());
  RELIEF_TRY(const Database copied,
             Database::open(copy->file(), Database::Access::Damaged, detail::model_kind(), file));
  auto rescued = from(copied, beside, progress);
  return rescued || rescued.error().code != Errc::Corrupt ? std::move(rescued) : std::unexpected(known.error());
}

Result<ModelFile::Rescued> ModelFile::Rescued::from(const Database& source, const std::filesystem::path& beside,
                                                    const Progress& progress) {
  const Database::Cancellable cancellable(source, progress);
  const Status checked = source.check_tables(part_of(progress, "salvage", 0, kTablesShare));
  if (!checked && checked.error().code != Errc::Corrupt) return std::unexpected(checked.error());
  RELIEF_TRY(Replacement place, Replacement::make(beside, detail::model_kind()));
  RELIEF_TRY(const Database rows, Database::open(place.file(), Database::Access::Write, detail::model_kind(), beside));
  RELIEF_CHECK(rows.run("PRAGMA journal_mode = OFF"));
  RELIEF_CHECK(rows.run("PRAGMA synchronous = OFF"));
  RELIEF_CHECK(rows.run("BEGIN"));
  RELIEF_CHECK(rows.write_tables());
  progress("salvage", kTablesShare);
  RELIEF_CHECK(copy_rows(source, rows, progress));
  RELIEF_TRY(const std::int64_t fibres, cage_count(rows, "fibres", detail::kFibreBytes));
  RELIEF_TRY(const std::int64_t slabs, cage_count(rows, "slabs", detail::kSlabBytes));
  if (fibres == 0 || slabs == 0) return source.failure(Errc::Corrupt, std::string(kNothing) + "its cage is lost");
  RELIEF_TRY(Facts facts, facts_of(source, fibres, slabs));
  progress("salvage", 0.3);
  RELIEF_TRY(HistoryCheck check,
             detail::check_history(rows, source, checked.has_value(), facts.hold ? facts.meta.last : -1, progress));
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

Result<ModelFile> ModelFile::Rescued::open_at(std::uint64_t stroke, const Progress& progress) {
  {
    RELIEF_TRY(const Database rows, Database::open(place.file(), Database::Access::Write, detail::model_kind()));
    RELIEF_CHECK(rows.run("PRAGMA synchronous = OFF"));
    Meta there = meta;
    there.current = static_cast<std::int64_t>(stroke);
    RELIEF_CHECK(detail::Rows(rows).write_meta(there));
  }
  return ModelFile::open(place.file(), true, progress);
}

std::optional<Salvaged> ModelFile::Rescued::whole_span() const {
  const auto newest = newest_whole(check.readable, meta.current);
  if (!newest) return std::nullopt;
  const auto is_whole = [&](std::int64_t k) {
    return k >= 0 && k <= check.last() && check.readable[static_cast<std::size_t>(k)];
  };
  std::int64_t first = *newest, last = *newest;
  while (is_whole(first - 1)) --first;
  while (is_whole(last + 1)) ++last;
  return Salvaged{.first = static_cast<std::uint64_t>(first),
                  .current = static_cast<std::uint64_t>(*newest),
                  .last = static_cast<std::uint64_t>(last)};
}

Result<bool> ModelFile::Rescued::write(const Salvaged& span, const std::filesystem::path& to,
                                       const Progress& progress) {
  const Progress quiet{.report = {}, .cancel = progress.cancel};
  std::uint64_t stroke = span.current;
  const auto give_up = [&](const Error& error) -> Result<bool> {
    if (error.code != Errc::Corrupt) return std::unexpected(error);
    check.readable[stroke] = false;
    reason = error.message;
    return false;
  };
  const auto source = open_at(span.current, quiet);
  if (!source) return give_up(source.error());
  stroke = span.first;
  auto head = source->at(stroke, quiet);
  if (!head) return give_up(head.error());
  RELIEF_TRY(const std::vector<StrokeRecord> records, source->strokes());
  Model model{.info = source->model().info, .head = *head};
  model.info.source_diagonal = source_diagonal(model);
  const FirstState first = span.first == 0 ? source->first_state() : FirstState::Sculpted;

  RELIEF_TRY(Replacement replacement, Replacement::make(to, detail::model_kind()));
  {
    RELIEF_TRY(ModelFile saved, make_unsaved(replacement.file(), to, model, first, quiet));
    const std::uint64_t count = span.last - span.first;
    for (stroke = span.first + 1; stroke <= span.last; ++stroke) {
      const std::uint64_t done = stroke - span.first;
      if (done * 50 / count != (done - 1) * 50 / count)
        progress("salvage", 0.5 + 0.5 * static_cast<double>(done) / static_cast<double>(count));
      auto next = source->at(stroke, *head, stroke - 1, quiet);
      if (!next) return give_up(next.error());
      RELIEF_CHECK(saved.commit(*next, records[stroke - 1], quiet));
      head = std::move(next);
    }
    if (span.current != span.last) RELIEF_CHECK(saved.go_to(span.current - span.first, source->model().head));
  }
  RELIEF_CHECK(replacement.replace_target());
  return true;
}

std::vector<std::string> ModelFile::Rescued::lost(const Salvaged& span) const {
  std::vector<std::string> lost;
  for (const DamagedStrokes& run : runs(check.readable, false, span)) lost.push_back(name_of(run) + " (damaged)");
  for (const DamagedStrokes& run : runs(check.readable, true, span))
    lost.push_back(name_of(run) + " (cut off by that)");
  for (const std::uint64_t stroke : unnamed)
    if (stroke > span.first && stroke <= span.last)
      lost.push_back("the label and text of stroke " + std::to_string(stroke));
  if (!facts_hold) lost.emplace_back("which stroke was current; mode, unit and source are as they read");
  return lost;
}

Result<Salvaged> ModelFile::salvage(const std::filesystem::path& from, const std::filesystem::path& to,
                                    const Progress& progress) {
  std::error_code code;
  if (std::filesystem::equivalent(from, to, code))
    return fail(Errc::InvalidArgument, "'" + printable(to.string()) +
                                           "' is the damaged model itself: choose another name for what is salvaged");
  RELIEF_TRY(Rescued rescued, Rescued::from(from, to, progress));
  while (auto span = rescued.whole_span()) {
    RELIEF_TRY(const bool written, rescued.write(*span, to, progress));
    if (!written) continue;
    span->lost = rescued.lost(*span);
    return *std::move(span);
  }
  return fail(Errc::Corrupt, "'" + printable(from.string()) + "' " + kNothing + rescued.reason);
}

}  // namespace relief
