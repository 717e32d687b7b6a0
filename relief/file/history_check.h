// Which strokes of a model file can be read: a function of the checksums of its rows and of nothing else.
#pragma once

#include <relief/base/progress.h>
#include <relief/file/database.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace relief::detail {

/// Holds what is known of the strokes 0 to last; 0 is the model before its first stroke.
struct HistoryCheck {
  std::vector<bool> readable;  ///< all rows that the state after the stroke needs are there and hold

  [[nodiscard]] std::int64_t last() const noexcept { return static_cast<std::int64_t>(readable.size()) - 1; }
};

/// Reads every row, and judges by one rule. Which rows a stroke wrote is known where its record holds and says as many
/// as there are; rows that fail their checksum are counted by their key, which stands in the table's index too. A row
/// that does not hold takes with it the states from its stroke up to the next row that makes its page (or its layer)
/// again; if the cage changes before that, and may carry the page over into others, up to the next stroke that tells
/// the cage as a whole, too. A row of the cage takes with it all up to that. Where it is not known which rows a stroke
/// wrote, no state from it on is readable.
/// `rows_of`: the rows that states will be read from. `names_of`: whose indexes name them; the same database, or the
/// damaged one that the rows were copied from (a damaged page may read once and not again). `tables_hold`:
/// check_tables() found its tables and indexes in agreement. `last`: of the strokes that are judged; negative: the last
/// whose record holds. Errors: Io, Cancelled.
[[nodiscard]] Result<HistoryCheck> check_history(const Database& rows_of, const Database& names_of, bool tables_hold,
                                                 std::int64_t last, const Progress& progress);

/// Visits the rows of "SELECT `columns` FROM `table`" in the order of `order`, and where the table is damaged also from
/// its other end, so a row may come twice. Errors: those of `visit`, Io, Cancelled.
[[nodiscard]] Status scan(const Database& database, const std::string& select, const std::string& order,
                          const std::function<Status(const Statement&)>& visit);

// ---- The checksums of rows, by their columns in the order of the tables

[[nodiscard]] bool cage_holds(const Statement& row);    ///< of the table cage
[[nodiscard]] bool page_holds(const Statement& row);    ///< of the table pages
[[nodiscard]] bool layer_holds(const Statement& row);   ///< of the table layers
[[nodiscard]] bool stroke_holds(const Statement& row);  ///< of the table strokes

}  // namespace relief::detail
