// What is whole in a database file whose end is missing: rows, read page by page and not by way of the tables' trees,
// whose pages may lie beyond the cut. After the description of SQLite's file format, version 3.
#pragma once

#include <relief/file/database.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace relief::detail {

/// One thread at a time.
class CutDatabase {
 public:
  /// Empty where the file is not a database of this kind that is shorter than it says. Error: Io.
  [[nodiscard]] static Result<std::optional<CutDatabase>> open(const std::filesystem::path& file, const FileKind& kind);
  CutDatabase(CutDatabase&& other) noexcept;
  CutDatabase& operator=(CutDatabase&&) = delete;
  ~CutDatabase();

  /// Bytes that are there, and that the file had.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::uint64_t whole_bytes() const noexcept { return whole_bytes_; }

  /// Says where a row begins.
  struct Place {
    std::uint32_t page = 1;  ///< from 1 on
    std::uint32_t cell = 0;
  };
  struct Value {
    Statement::Type type = Statement::Type::Null;
    std::int64_t integer = 0;               ///< of an integer
    std::span<const std::byte> bytes = {};  ///< of a text or a blob; valid until the next row is read
    [[nodiscard]] std::string_view text() const noexcept {
      return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
  };
  struct Row {
    Place place;
    std::int64_t number = 0;  ///< its key, where the table has whole numbers for keys: that column is null
    std::vector<Value> values;
  };
  /// Returns the first whole row at `from` or behind it, of whatever table; `from` becomes what follows. False at the
  /// end. Nothing is promised of what a row holds: its checksum says whether it is one of ours.
  [[nodiscard]] bool next(Place& from, Row& row);
  /// Returns the row that next() gave with this place.
  [[nodiscard]] bool read(Place place, Row& row);

 private:
  CutDatabase(int descriptor, std::uint64_t bytes, std::uint64_t whole_bytes, std::size_t page_size,
              std::size_t usable);
  /// Reads a page into `page_`; false where it is not whole.
  [[nodiscard]] bool load(std::uint32_t page);
  /// Cells of the loaded page; 0 where it is no leaf of a table.
  [[nodiscard]] std::uint32_t cells() const noexcept;
  /// Puts the payload of a cell of the loaded page together.
  [[nodiscard]] bool gather(std::uint32_t cell, std::int64_t& number);
  /// Takes the payload apart.
  [[nodiscard]] bool parse(std::vector<Value>& values) const;

  int descriptor_;
  std::uint64_t bytes_, whole_bytes_;
  std::size_t page_size_, usable_;
  std::uint32_t loaded_ = 0;  ///< number of the page in page_; 0: none
  std::vector<std::byte> page_, overflow_, payload_;
};

}  // namespace relief::detail
