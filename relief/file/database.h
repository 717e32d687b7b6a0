// SQLite, as far as our files need it: results instead of codes, every error a sentence that names the file.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace relief::detail {

/// Holds what tells one kind of our database files from all others.
struct FileKind {
  struct Table {
    std::string_view name;
    std::string_view definition;  ///< its exact text, which opening compares
  };
  std::string_view suffix;  ///< what messages call it, such as ".relief"
  std::int64_t application_id;
  std::int64_t newest_format;
  std::span<const Table> tables;  ///< and nothing else may stand in the file
};

/// Holds what errors speak of.
struct OpenFile {
  std::filesystem::path name;
  const FileKind* kind;
};

/// One SQL statement. Parameters are bound in order; text and blobs must live until the statement is done or reset.
class Statement {
 public:
  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view value);
  Statement& bind(std::span<const std::byte> value);

  /// True: there is a row to read. False: done.
  [[nodiscard]] Result<bool> step();
  /// For statements without rows.
  [[nodiscard]] Status run();
  /// Ready for new parameters.
  void reset() noexcept;

  enum class Type : std::uint8_t { Integer, Real, Text, Blob, Null };
  [[nodiscard]] Type type(int column) const noexcept;
  [[nodiscard]] std::int64_t integer(int column) const noexcept;
  [[nodiscard]] double real(int column) const noexcept;
  /// Both valid until the next step.
  [[nodiscard]] std::string_view text(int column) const noexcept;
  [[nodiscard]] std::span<const std::byte> blob(int column) const noexcept;

 private:
  friend class Database;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  const OpenFile* file_ = nullptr;
  int parameter_ = 0;
  int bind_error_ = 0;
};

/// An open database. Statements must be gone before it is closed or moved.
class Database {
 public:
  /// Damaged: for reading, also where the file ends too early; what its damaged pages hold ends a statement as Corrupt.
  enum class Access : std::uint8_t { Read, Write, Damaged };
  /// Opens an existing regular file (an empty one is an empty database). What a killed writer left half done is undone
  /// first, for readers too where the place can be written. `kind` must outlive it. Errors speak of `named`, where
  /// given. Errors: NotFound, Io.
  [[nodiscard]] static Result<Database> open(const std::filesystem::path& place, Access access, const FileKind& kind,
                                             const std::filesystem::path& named = {});

  /// Makes the tables of its kind in an empty database, inside a transaction that the caller ends.
  [[nodiscard]] Status write_tables() const;
  /// That it is of its kind, in a format that we know.
  [[nodiscard]] Status check_format() const;
  /// That it has the tables of its kind, and nothing else.
  [[nodiscard]] Status check_definitions() const;
  /// Returns the same, and that SQLite finds them sound. Reads the whole file, page by page: `progress`, of the phase
  /// "open", is told and asked between pages. Errors: Corrupt, Io, Cancelled.
  [[nodiscard]] Status check_tables(const Progress& progress = {}) const;

  [[nodiscard]] Result<Statement> prepare(std::string_view sql) const;
  /// Runs one statement and drops its rows.
  [[nodiscard]] Status run(std::string_view sql) const;
  /// Returns the first column of the first row; 0 where there is none.
  [[nodiscard]] Result<std::int64_t> integer(std::string_view sql) const;
  /// Returns whether a transaction is open.
  [[nodiscard]] bool in_transaction() const noexcept;
  /// Returns a number in the file to which every commit that writes adds one, whoever makes it; 0 where it cannot be
  /// read. It is read past all caches and locks: a program that opens and closes the file beside SQLite drops the locks
  /// of its process.
  [[nodiscard]] std::uint32_t change_counter() const noexcept;
  /// Begins to read: until roll_back() all is of one moment, and nobody else commits.
  [[nodiscard]] Status begin_reading() const;
  /// Ends the open transaction, if any, without its changes.
  void roll_back() const noexcept;
  /// Replaces the content of this database by that of another, as it is at one moment. Errors: Cancelled, Io, Corrupt.
  [[nodiscard]] Status copy_from(const Database& other, const Progress& progress = {}) const;
  /// While it lives, `progress` can cancel what the database does: the statement that runs ends with Cancelled.
  class Cancellable {
   public:
    Cancellable(const Database& database, const Progress& progress) noexcept;
    Cancellable(const Cancellable&) = delete;
    Cancellable& operator=(const Cancellable&) = delete;
    ~Cancellable();

   private:
    sqlite3* handle_;
  };

  [[nodiscard]] std::unexpected<Error> failure(Errc code, std::string_view what) const;
  /// Corrupt, "is damaged: ...".
  [[nodiscard]] std::unexpected<Error> damaged(std::string_view what) const;
  /// Cancelled, "stays as it was: the work was cancelled".
  [[nodiscard]] std::unexpected<Error> cancelled() const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };
  std::unique_ptr<OpenFile> file_;  // statements point to it
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A new, empty file of a kind beside `target` that will take its place; removed again unless replace_target() is
/// called. What killed runs left there is removed when it is older than a minute and no process holds it.
class Replacement {
 public:
  [[nodiscard]] static Result<Replacement> make(const std::filesystem::path& target, const FileKind& kind);
  Replacement(Replacement&& other) noexcept;
  Replacement& operator=(Replacement&&) = delete;
  ~Replacement();

  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }
  /// Returns the real place of the target, links resolved.
  [[nodiscard]] const std::filesystem::path& target() const noexcept { return target_; }
  /// Puts the file in the target's place, on disk, once nobody works with the old one. Close the database first.
  [[nodiscard]] Status replace_target();

 private:
  Replacement() = default;
  std::filesystem::path target_, file_;
  const FileKind* kind_ = nullptr;
  int descriptor_ = -1;  // holds the lock that says that somebody still writes the file
};

}  // namespace relief::detail
