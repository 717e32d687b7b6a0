#include <relief/base/try.h>
#include <relief/core/snapshot.h>
#include <relief/file/cage_rows.h>
#include <relief/file/checksum.h>
#include <relief/file/history_check.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace relief::detail {

namespace {

/// A page of a layer, or (kTheLayer) the row that says since when and how finely the layer is there.
using Key = std::pair<std::int64_t, std::int64_t>;
constexpr std::int64_t kTheLayer = -1;
constexpr std::int64_t kTheCage = -1;    ///< in the place of a layer: then comes the kind of part
constexpr std::int64_t kNotNeeded = -2;  ///< the same of a part that no state needs

enum class Row : std::uint8_t {
  Lost,     ///< the index, or the table itself, says that there is such a row, and none holds
  Follows,  ///< a page as differences to the one before
  Anew      ///< a page as it is; a layer; a part of the cage
};

/// Holds what the file shows of its rows and records.
struct Evidence {
  std::map<Key, std::map<std::int64_t, Row>> rows;                 ///< by key and stroke
  std::map<std::int64_t, std::optional<std::int64_t>> row_counts;  ///< by stroke; nothing where the record fails
  std::set<std::int64_t> cage_changes;                             ///< strokes
  std::set<std::int64_t> whole_cages;                              ///< strokes that told all of it, in rows that hold

  void saw(std::string_view layer_name, std::int64_t page, std::int64_t stroke, Row row) {
    const auto layer = layer_from_name(layer_name);
    if (layer && stroke >= 0) saw({static_cast<std::int64_t>(*layer), page}, stroke, row);
  }
  void saw_part(std::string_view name, Row row) {
    const auto part = CagePart::from_name(name);
    if (!part) return;
    saw({part->is_needed() ? kTheCage : kNotNeeded, part->kind}, part->stroke, row);
    cage_changes.insert(part->stroke);
    if (row != Row::Lost && part->makes_cage_anew()) whole_cages.insert(part->stroke);
  }

 private:
  void saw(const Key& key, std::int64_t stroke, Row row) {
    Row& known = rows[key].try_emplace(stroke, Row::Lost).first->second;
    known = std::max(known, row);
  }
};

Result<Evidence> gather(const Database& rows, const Database& named, const Progress& progress) {
  Evidence found;
  const auto going_on = [&]() -> Status { return progress.cancelled() ? rows.cancelled() : Status(); };
  RELIEF_CHECK(scan(rows, "SELECT * FROM pages NOT INDEXED", "rowid", [&](const Statement& row) {
    const Row kind = !page_holds(row) ? Row::Lost : row.integer(3) != 0 ? Row::Anew : Row::Follows;
    found.saw(row.text(0), row.integer(1), row.integer(2), kind);
    return going_on();
  }));
  RELIEF_CHECK(scan(rows, "SELECT * FROM layers NOT INDEXED", "rowid", [&](const Statement& row) {
    found.saw(row.text(0), kTheLayer, row.integer(1), layer_holds(row) ? Row::Anew : Row::Lost);
    return going_on();
  }));
  RELIEF_CHECK(scan(rows, "SELECT * FROM cage NOT INDEXED", "rowid", [&](const Statement& row) {
    found.saw_part(row.text(0), cage_holds(row) ? Row::Anew : Row::Lost);
    return going_on();
  }));
  RELIEF_CHECK(scan(rows, "SELECT * FROM strokes", "number", [&](const Statement& row) {
    found.row_counts[row.integer(0)] = stroke_holds(row) ? std::optional(row.integer(4)) : std::nullopt;
    return going_on();
  }));
  // From the indexes alone, which hold all columns that are asked for.
  RELIEF_CHECK(scan(named, "SELECT layer, page, stroke FROM pages INDEXED BY sqlite_autoindex_pages_1",
                    "layer, page, stroke", [&](const Statement& row) {
                      found.saw(row.text(0), row.integer(1), row.integer(2), Row::Lost);
                      return going_on();
                    }));
  RELIEF_CHECK(scan(named, "SELECT layer, stroke FROM layers INDEXED BY sqlite_autoindex_layers_1", "layer, stroke",
                    [&](const Statement& row) {
                      found.saw(row.text(0), kTheLayer, row.integer(1), Row::Lost);
                      return going_on();
                    }));
  RELIEF_CHECK(
      scan(named, "SELECT part FROM cage INDEXED BY sqlite_autoindex_cage_1", "part", [&](const Statement& row) {
        found.saw_part(row.text(0), Row::Lost);
        return going_on();
      }));
  RELIEF_CHECK(scan(named, "SELECT number FROM strokes", "number", [&](const Statement& row) {
    found.row_counts.try_emplace(row.integer(0));
    return going_on();
  }));
  return found;
}

std::int64_t last_recorded(const Evidence& evidence) {
  std::int64_t last = -1;
  for (const auto& [stroke, row_count] : evidence.row_counts)
    if (row_count) last = std::max(last, stroke);
  return last;
}

/// Returns the stroke of the first row after `stroke` that makes the key again; `none` where there is none.
std::int64_t made_anew(const Evidence& evidence, const Key& key, std::int64_t stroke, std::int64_t none) {
  const auto rows = evidence.rows.find(key);
  if (rows == evidence.rows.end()) return none;
  for (auto row = rows->second.upper_bound(stroke); row != rows->second.end(); ++row)
    if (row->second == Row::Anew) return std::min(row->first, none);
  return none;
}

/// Returns the first of some strokes after another; `none` where there is none.
std::int64_t next_of(const std::set<std::int64_t>& strokes, std::int64_t stroke, std::int64_t none) {
  const auto next = strokes.upper_bound(stroke);
  return next == strokes.end() ? none : std::min(*next, none);
}

/// Returns the stroke from which on a row that was lost at another one matters no more; `none` where it matters for
/// ever.
std::int64_t end_of_loss(const Evidence& evidence, const Key& key, std::int64_t stroke, std::int64_t none) {
  if (key.first == kTheCage) return next_of(evidence.whole_cages, stroke, none);
  std::int64_t end = made_anew(evidence, key, stroke, none);
  if (const std::int64_t carried = next_of(evidence.cage_changes, stroke, none); carried < end)
    end = std::max(end, next_of(evidence.whole_cages, carried - 1, none));
  return std::min(end, made_anew(evidence, {key.first, kTheLayer}, stroke, none));
}

}  // namespace

Result<HistoryCheck> check_history(const Database& rows_of, const Database& names_of, bool tables_hold,
                                   std::int64_t last, const Progress& progress) {
  RELIEF_TRY(const Evidence evidence, gather(rows_of, names_of, progress));
  if (last < 0) last = last_recorded(evidence);
  HistoryCheck check;
  check.readable.assign(static_cast<std::size_t>(last + 1), true);

  struct Count {
    std::int64_t holding = 0, named = 0;
  };
  std::vector<Count> counts(check.readable.size());
  for (const auto& [key, rows] : evidence.rows)
    for (const auto& [stroke, row] : rows) {
      if (stroke > last) continue;
      ++counts[static_cast<std::size_t>(stroke)].named;
      if (row != Row::Lost) ++counts[static_cast<std::size_t>(stroke)].holding;
    }
  std::vector<bool> all_hold(check.readable.size());
  std::int64_t first_unknown = last + 1;
  for (std::int64_t stroke = 0; stroke <= last; ++stroke) {
    const auto& [holding, named] = counts[static_cast<std::size_t>(stroke)];
    const auto record = evidence.row_counts.find(stroke);
    const bool recorded = record != evidence.row_counts.end();
    const std::optional<std::int64_t> wrote = recorded ? record->second : std::nullopt;
    all_hold[static_cast<std::size_t>(stroke)] = wrote == holding;
    const bool known = wrote ? *wrote == holding || *wrote == named : recorded && tables_hold;
    if (!known) first_unknown = std::min(first_unknown, stroke);
  }
  std::fill(check.readable.begin() + first_unknown, check.readable.end(), false);
  for (const auto& [key, rows] : evidence.rows)
    for (const auto& [stroke, row] : rows) {
      if (row != Row::Lost || key.first == kNotNeeded || stroke > last || all_hold[static_cast<std::size_t>(stroke)])
        continue;
      const std::int64_t end = end_of_loss(evidence, key, stroke, last + 1);
      std::fill(check.readable.begin() + stroke, check.readable.begin() + end, false);
    }
  return check;
}

Status scan(const Database& database, const std::string& select, const std::string& order,
            const std::function<Status(const Statement&)>& visit) {
  std::string backwards = order;
  for (std::size_t at = 0; (at = backwards.find(',', at)) != std::string::npos; at += 6) backwards.insert(at, " DESC");
  const auto read = [&](const std::string& by) -> Status {
    RELIEF_TRY(Statement rows, database.prepare(select + " ORDER BY " + by));
    for (;;) {
      RELIEF_TRY(const bool row, rows.step());
      if (!row) return {};
      RELIEF_CHECK(visit(rows));
    }
  };
  Status done = read(order);
  if (!done && done.error().code == Errc::Corrupt) done = read(backwards + " DESC");
  return !done && done.error().code == Errc::Corrupt ? Status() : done;
}

bool cage_holds(const Statement& row) {
  return (is_first_part(row.text(0)) || CagePart::from_name(row.text(0))) &&
         row.integer(1) == hash_of(row.text(0), row.blob(2));
}
bool page_holds(const Statement& row) {
  return row.integer(5) ==
         hash_of(row.text(0), row.blob(6), row.integer(1), row.integer(2), row.integer(3), row.integer(4));
}
bool layer_holds(const Statement& row) {
  return row.integer(3) == hash_of(row.text(0), {}, row.integer(1), row.integer(2));
}
bool stroke_holds(const Statement& row) {
  return row.integer(5) == hash_of(row.text(1), bytes_of(row.text(2)), row.integer(0), row.integer(3), row.integer(4));
}

}  // namespace relief::detail
