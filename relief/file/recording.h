// The .rlog file: an SQLite database of numbered rows, appended in batches, that says itself what its rows are made of.
// It knows bytes and columns; what they mean is its writer's matter.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relief {

inline constexpr int kRecordingFormat = 1;

/// How one number of a row lies in its bytes, little-endian and without gaps.
enum class NumberType : std::uint8_t { F64, F32, U64, U32, I32, U8 };
[[nodiscard]] std::string_view name(NumberType type) noexcept;
[[nodiscard]] constexpr std::size_t bytes_of(NumberType type) noexcept {
  return type == NumberType::F64 || type == NumberType::U64 ? 8 : type == NumberType::U8 ? 1 : 4;
}

/// A column of a stream.
struct RecordingColumn {
  std::string name;                   ///< such as "force.x"
  NumberType type = NumberType::F64;  ///< how its numbers are stored
  std::string unit;                   ///< empty for a plain number
  std::string role;                   ///< such as "input"
  friend bool operator==(const RecordingColumn&, const RecordingColumn&) = default;
};
using RecordingColumns = std::vector<RecordingColumn>;
[[nodiscard]] std::size_t row_bytes(const RecordingColumns& columns) noexcept;
/// Returns the number in column k of a row as text: the shortest that gives the same bits back.
[[nodiscard]] std::string text_of(std::span<const std::byte> number, NumberType type);
/// Returns the same of a column that may be one of those in which the greatest number means none: -1 for it.
[[nodiscard]] std::string text_of(std::span<const std::byte> number, const RecordingColumn& column,
                                  std::span<const std::string_view> or_none);

/// The stream whose rows are the ticks; rows of all other streams are events.
inline constexpr std::string_view kTickStream = "tick";

/// Holds what stands at the head of a recording.
struct RecordingHead {
  std::map<std::string, std::string, std::less<>> facts;         ///< what is known of the recording as a whole, by name
  std::map<std::string, RecordingColumns, std::less<>> streams;  ///< the streams, by name
  /// Returns the fact, or empty.
  [[nodiscard]] std::string_view fact(std::string_view key) const noexcept;
};

/// A row that does not come with every tick. Events keep their order; `at` is what its stream makes of it.
struct RecordingEvent {
  std::string stream;          ///< which stream
  std::uint64_t at = 0;        ///< number of the tick that it came before
  std::vector<std::byte> row;  ///< its values, as the stream's columns say
};

/// Consecutive ticks; numbers that no run has were lost.
struct TickRun {
  /// the first tick, and how many follow each other
  std::uint64_t first = 0, count = 0;
};

/// Makes and grows a recording. One thread at a time.
class RecordingWriter {
 public:
  /// An existing file is replaced, at once and as a whole. The new one grows with every commit(), and keeps
  /// what was committed whatever happens to the process. Errors: Io, InvalidArgument (no stream of ticks).
  [[nodiscard]] static Result<RecordingWriter> create(const std::filesystem::path& file, RecordingHead head);
  /// Takes over; the other one may only be destroyed or assigned to.
  RecordingWriter(RecordingWriter&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  ~RecordingWriter();

  /// Ticks first, first + 1, ... as whole rows, at most kMaxBatch of them; later than all before. Error: Io.
  [[nodiscard]] Status add_ticks(std::uint64_t first, std::span<const std::byte> rows);
  /// Adds an event. Errors: Io.
  [[nodiscard]] Status add_event(const RecordingEvent& event);
  /// Returns what was added since the last time is in the file; after a kill -9 it still is. Error: Io.
  [[nodiscard]] Status commit();
  /// Adds facts that were not known before, commits and closes. Error: Io.
  [[nodiscard]] Status finish(const std::map<std::string, std::string, std::less<>>& facts);
  /// Ticks that are in the file whatever happens, also after an error.
  [[nodiscard]] std::uint64_t committed_ticks() const noexcept;

  static constexpr std::size_t kMaxBatch = 4096;  ///< rows written at once

 private:
  struct State;
  explicit RecordingWriter(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

/// An open recording. One thread at a time.
class Recording {
 public:
  /// Opens and checks everything it reads: format, tables, checksums, sizes before memory is taken. A recording whose
  /// writer was killed opens with what was committed, and one that was cut short with what is whole of it. Errors:
  /// NotFound, Io, Corrupt, NewerVersion, UnsupportedFormat (not a .rlog file).
  [[nodiscard]] static Result<Recording> open(const std::filesystem::path& file);
  /// Takes over; the other one may only be destroyed or assigned to.
  Recording(Recording&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  Recording& operator=(Recording&&) noexcept;
  ~Recording();

  /// Returns the file that is read.
  [[nodiscard]] const std::filesystem::path& file() const noexcept;
  /// Returns what its head says.
  [[nodiscard]] const RecordingHead& head() const noexcept;
  [[nodiscard]] const RecordingColumns& columns() const noexcept;  ///< of the ticks
  /// Returns all events, in order.
  [[nodiscard]] const std::vector<RecordingEvent>& events() const noexcept;
  /// Ticks without a gap, in order.
  [[nodiscard]] const std::vector<TickRun>& runs() const noexcept;
  /// Returns how many ticks there are.
  [[nodiscard]] std::uint64_t tick_count() const noexcept;
  /// Of a file that was cut short: bytes that are there, and that it had.
  struct Cut {
    /// the file's length, and how much of it is whole
    std::uint64_t bytes = 0, whole_bytes = 0;
  };
  /// Returns where the recording breaks off, if it does.
  [[nodiscard]] const std::optional<Cut>& cut() const noexcept;

  /// Returns the next batch of ticks; false at the end, and then from the start again. `rows` is valid until the next
  /// call. Error: Corrupt.
  [[nodiscard]] Result<bool> next(std::uint64_t& first, std::span<const std::byte>& rows);
  /// Begins again at the first tick.
  void rewind() noexcept;
  /// Corrupt: "'FILE' is damaged: ..."; for who reads the rows.
  [[nodiscard]] std::unexpected<Error> damaged(std::string_view what) const;

 private:
  struct State;
  explicit Recording(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

/// Names of u32 columns in which the greatest number means that there is none; exports write -1 for it.
using NoneColumns = std::span<const std::string_view>;
/// Every tick as a line: its number, then its columns, named with their units in the header line ("t [s]"). Errors: Io,
/// Cancelled (no file is made).
[[nodiscard]] Status export_csv(Recording& recording, const std::filesystem::path& file, NoneColumns or_none = {},
                                const Progress& progress = {});
/// MCAP 0 without compression: one channel "/relief/tick" of JSON messages with a JSON schema, one per tick, and the
/// facts as metadata. Names with dots become nested objects; what is no finite number becomes null. Errors: Io,
/// Cancelled (no file is made).
[[nodiscard]] Status export_mcap(Recording& recording, const std::filesystem::path& file, NoneColumns or_none = {},
                                 const Progress& progress = {});

}  // namespace relief
