#include <relief/base/try.h>
#include <relief/file/checksum.h>
#include <relief/file/database.h>
#include <relief/file/recording.h>
#include <relief/file/tile_codec.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <set>

namespace relief {

namespace {

using detail::Bytes;
using detail::bytes_of;
using detail::Database;
using detail::hash_of;
using detail::Replacement;
using detail::Statement;

constexpr std::array<detail::FileKind::Table, 4> kTables = {{
    {"facts", "CREATE TABLE facts(key TEXT PRIMARY KEY, value TEXT NOT NULL, hash INTEGER NOT NULL) STRICT"},
    {"columns",
     "CREATE TABLE columns(stream TEXT NOT NULL, position INTEGER NOT NULL, name TEXT NOT NULL, type TEXT NOT NULL, "
     "unit TEXT NOT NULL, role TEXT NOT NULL, hash INTEGER NOT NULL, PRIMARY KEY(stream, position)) STRICT"},
    {"ticks",
     "CREATE TABLE ticks(first INTEGER PRIMARY KEY, count INTEGER NOT NULL, hash INTEGER NOT NULL, "
     "data BLOB NOT NULL) STRICT"},
    {"events",
     "CREATE TABLE events(number INTEGER PRIMARY KEY, stream TEXT NOT NULL, at INTEGER NOT NULL, "
     "hash INTEGER NOT NULL, data BLOB NOT NULL) STRICT"},
}};
constexpr detail::FileKind kKind = {
    .suffix = ".rlog", .application_id = 0x524c4731, .newest_format = kRecordingFormat, .tables = kTables};  // "RLG1"

constexpr std::size_t kMaxColumns = 1024;
constexpr std::int64_t kMaxTick = std::int64_t{1} << 53;

std::optional<NumberType> type_from_name(std::string_view text) {
  for (const NumberType type :
       {NumberType::F64, NumberType::F32, NumberType::U64, NumberType::U32, NumberType::I32, NumberType::U8})
    if (text == name(type)) return type;
  return std::nullopt;
}

std::int64_t hash_of(std::string_view stream, std::int64_t position, const RecordingColumn& c) {
  return hash_of(std::string(stream) + '/' + c.name + '/' + std::string(name(c.type)) + '/' + c.unit,
                 bytes_of(std::string_view(c.role)), position);
}

template <typename T>
std::string shortest(Bytes bytes) {
  T value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace

std::string_view name(NumberType type) noexcept {
  switch (type) {
    case NumberType::F64:
      return "f64";
    case NumberType::F32:
      return "f32";
    case NumberType::U64:
      return "u64";
    case NumberType::U32:
      return "u32";
    case NumberType::I32:
      return "i32";
    case NumberType::U8:
      return "u8";
  }
  return "";
}

std::size_t row_bytes(const RecordingColumns& columns) noexcept {
  std::size_t bytes = 0;
  for (const RecordingColumn& column : columns) bytes += bytes_of(column.type);
  return bytes;
}

std::string text_of(Bytes number, NumberType type) {
  switch (type) {
    case NumberType::F64:
      return shortest<double>(number);
    case NumberType::F32:
      return shortest<float>(number);
    case NumberType::U64:
      return shortest<std::uint64_t>(number);
    case NumberType::U32:
      return shortest<std::uint32_t>(number);
    case NumberType::I32:
      return shortest<std::int32_t>(number);
    case NumberType::U8:
      return std::to_string(std::to_integer<int>(number[0]));
  }
  return {};
}

std::string_view RecordingHead::fact(std::string_view key) const noexcept {
  const auto found = facts.find(key);
  return found == facts.end() ? std::string_view() : found->second;
}

// ---- Writing

struct RecordingWriter::State {
  std::filesystem::path file;
  std::optional<Replacement> replacement;  ///< while the file has no name yet
  std::optional<Database> database;
  std::map<std::string, std::size_t, std::less<>> widths;
  std::uint64_t next_tick = 0;
  std::int64_t events = 0;

  /// Opens the file for a long time of small commits. A commit survives the death of the process; a power cut may take
  /// the last ones, never more.
  [[nodiscard]] Status open(const std::filesystem::path& place) {
    RELIEF_TRY(Database opened, Database::open(place, Database::Access::Write, kKind, file));
    RELIEF_CHECK(opened.run("PRAGMA journal_mode = DELETE"));
    RELIEF_CHECK(opened.run("PRAGMA synchronous = NORMAL"));
    database.emplace(std::move(opened));
    return {};
  }
  [[nodiscard]] Status begin() const {
    return database->in_transaction() ? Status{} : database->run("BEGIN IMMEDIATE");
  }
  /// While somebody reads the file, the transaction stays open for the next time.
  [[nodiscard]] Status commit(bool last = false) const {
    if (!database->in_transaction()) return {};
    const Status done = database->run("COMMIT");
    return done || last || !database->in_transaction() ? done : Status{};
  }

  [[nodiscard]] Status write_fact(std::string_view key, std::string_view value) const {
    RELIEF_CHECK(begin());
    RELIEF_TRY(Statement put, database->prepare("INSERT OR REPLACE INTO facts VALUES(?, ?, ?)"));
    return put.bind(key).bind(value).bind(hash_of(key, bytes_of(value))).run();
  }
  [[nodiscard]] Status write_columns(std::string_view stream, const RecordingColumns& columns) const {
    RELIEF_TRY(Statement put, database->prepare("INSERT INTO columns VALUES(?, ?, ?, ?, ?, ?, ?)"));
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const RecordingColumn& c = columns[k];
      const auto position = static_cast<std::int64_t>(k);
      put.reset();
      RELIEF_CHECK(put.bind(stream)
                       .bind(position)
                       .bind(std::string_view(c.name))
                       .bind(name(c.type))
                       .bind(std::string_view(c.unit))
                       .bind(std::string_view(c.role))
                       .bind(hash_of(stream, position, c))
                       .run());
    }
    return {};
  }
  /// The name of the file, from now on.
  [[nodiscard]] Status show() {
    database.reset();
    Status shown = replacement->replace_target();
    replacement.reset();
    return shown;
  }
};

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& file, RecordingHead head, Appear appear) {
  if (row_bytes(head.streams[std::string(kTickStream)]) == 0)
    return fail(Errc::InvalidArgument, "a recording needs columns for its ticks");
  auto state = std::make_unique<State>();
  state->file = file;
  RELIEF_TRY(Replacement made, Replacement::make(file, kKind));
  state->replacement.emplace(std::move(made));
  RELIEF_CHECK(state->open(state->replacement->file()));
  RELIEF_CHECK(state->begin());
  RELIEF_CHECK(state->database->write_tables());
  for (const auto& [key, value] : head.facts) RELIEF_CHECK(state->write_fact(key, value));
  for (const auto& [stream, columns] : head.streams) {
    RELIEF_CHECK(state->write_columns(stream, columns));
    state->widths[stream] = row_bytes(columns);
  }
  RELIEF_CHECK(state->commit(true));
  if (appear == Appear::AtOnce) {
    const std::filesystem::path target = state->replacement->target();
    RELIEF_CHECK(state->show());
    RELIEF_CHECK(state->open(target));
  }
  return RecordingWriter(std::move(state));
}

Status RecordingWriter::add_ticks(std::uint64_t first, Bytes rows) {
  const std::size_t width = state_->widths.find(kTickStream)->second, count = rows.size() / width;
  if (count == 0) return {};
  if (count * width != rows.size() || count > kMaxBatch || first < state_->next_tick)
    return fail(Errc::InvalidArgument, "ticks come in whole rows and in order");
  state_->next_tick = first + count;
  const std::vector<std::byte> blob = detail::pack(rows, width);
  RELIEF_CHECK(state_->begin());
  RELIEF_TRY(Statement put, state_->database->prepare("INSERT INTO ticks VALUES(?, ?, ?, ?)"));
  return put.bind(static_cast<std::int64_t>(first))
      .bind(static_cast<std::int64_t>(count))
      .bind(hash_of(kTickStream, blob, first, count))
      .bind(Bytes(blob))
      .run();
}

Status RecordingWriter::add_event(const RecordingEvent& event) {
  const auto width = state_->widths.find(event.stream);
  if (width == state_->widths.end() || width->second != event.row.size())
    return fail(Errc::InvalidArgument, "an event is a row of a stream that the head names");
  RELIEF_CHECK(state_->begin());
  RELIEF_TRY(Statement put, state_->database->prepare("INSERT INTO events VALUES(?, ?, ?, ?, ?)"));
  const std::int64_t number = ++state_->events;
  return put.bind(number)
      .bind(std::string_view(event.stream))
      .bind(static_cast<std::int64_t>(event.at))
      .bind(hash_of(event.stream, event.row, number, event.at))
      .bind(Bytes(event.row))
      .run();
}

Status RecordingWriter::commit() { return state_->commit(); }

Status RecordingWriter::finish(const std::map<std::string, std::string, std::less<>>& facts) {
  for (const auto& [key, value] : facts) RELIEF_CHECK(state_->write_fact(key, value));
  RELIEF_CHECK(state_->commit(true));
  if (state_->replacement) return state_->show();
  state_->database.reset();
  return {};
}

// ---- Reading

struct Recording::State {
  State(std::filesystem::path path, Database opened) : file(std::move(path)), database(std::move(opened)) {}

  std::filesystem::path file;
  Database database;
  RecordingHead head;
  RecordingColumns columns;
  std::vector<RecordingEvent> events;
  std::vector<TickRun> runs;
  std::uint64_t tick_count = 0;
  std::optional<Statement> rows;  ///< of the table of ticks, while they are read
  std::vector<std::byte> batch;

  [[nodiscard]] Status read_facts() {
    RELIEF_TRY(Statement get, database.prepare("SELECT key, value, hash FROM facts ORDER BY key"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      const std::string_view key = get.text(0), value = get.text(1);
      if (get.integer(2) != hash_of(key, bytes_of(value))) return database.damaged("its facts fail their checksum");
      head.facts.emplace(key, value);
    }
  }

  [[nodiscard]] Status read_columns() {
    RELIEF_TRY(Statement get, database.prepare("SELECT stream, position, name, type, unit, role, hash FROM columns "
                                               "ORDER BY stream, position"));
    std::set<std::pair<std::string, std::string>> seen;
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) break;
      const auto type = type_from_name(get.text(3));
      const std::string stream(get.text(0));
      RecordingColumns& to = head.streams[stream];
      if (!type || seen.size() == kMaxColumns || get.integer(1) != static_cast<std::int64_t>(to.size()))
        return database.damaged("its columns do not make sense");
      to.push_back({std::string(get.text(2)), *type, std::string(get.text(4)), std::string(get.text(5))});
      if (get.integer(6) != hash_of(stream, get.integer(1), to.back()))
        return database.damaged("its columns fail their checksum");
      if (!seen.emplace(stream, to.back().name).second)
        return database.damaged("it has the column " + printable(to.back().name, 40) + " twice");
    }
    columns = head.streams[std::string(kTickStream)];
    if (columns.empty()) return database.damaged("it does not say what its ticks are made of");
    return {};
  }

  [[nodiscard]] Status read_events() {
    RELIEF_TRY(Statement get, database.prepare("SELECT number, stream, at, hash, data FROM events ORDER BY number"));
    for (std::int64_t number = 1;; ++number) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      const Bytes data = get.blob(4);
      RecordingEvent event{
          std::string(get.text(1)), static_cast<std::uint64_t>(get.integer(2)), {data.begin(), data.end()}};
      if (get.integer(0) != number) return database.damaged("event " + std::to_string(number) + " is missing");
      const auto stream = head.streams.find(event.stream);
      if (get.integer(3) != hash_of(event.stream, data, number, event.at))
        return database.damaged("event " + std::to_string(number) + " fails its checksum");
      if ((stream == head.streams.end() ? 0 : row_bytes(stream->second)) != data.size())
        return database.damaged("event " + std::to_string(number) + " has not the size of its columns");
      events.push_back(std::move(event));
    }
  }

  /// Which ticks there are, and that their batches may hold them.
  [[nodiscard]] Status read_runs() {
    const std::size_t width = row_bytes(columns);
    RELIEF_TRY(Statement get, database.prepare("SELECT first, count, length(data) FROM ticks ORDER BY first"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      const std::int64_t first = get.integer(0), count = get.integer(1);
      const std::uint64_t end = runs.empty() ? 0 : runs.back().first + runs.back().count;
      if (first < 0 || first > kMaxTick || count < 1 || count > static_cast<std::int64_t>(RecordingWriter::kMaxBatch) ||
          static_cast<std::uint64_t>(first) < end ||
          static_cast<std::size_t>(count) * width / detail::kMaxExpansion > static_cast<std::size_t>(get.integer(2)))
        return database.damaged("the batch of ticks from " + std::to_string(first) + " does not make sense");
      if (!runs.empty() && end == static_cast<std::uint64_t>(first))
        runs.back().count += static_cast<std::uint64_t>(count);
      else
        runs.push_back({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(count)});
      tick_count += static_cast<std::uint64_t>(count);
    }
  }
};

Recording::Recording(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;
Recording::~Recording() = default;

Result<Recording> Recording::open(const std::filesystem::path& file) {
  RELIEF_TRY(Database database, Database::open(file, Database::Access::Read, kKind));
  auto state = std::make_unique<State>(file, std::move(database));
  RELIEF_CHECK(state->database.check_format());
  RELIEF_CHECK(state->database.run("BEGIN"));  // one moment of a file that may still grow
  RELIEF_CHECK(state->database.check_tables());
  RELIEF_CHECK(state->read_facts());
  RELIEF_CHECK(state->read_columns());
  RELIEF_CHECK(state->read_events());
  RELIEF_CHECK(state->read_runs());
  return Recording(std::move(state));
}

const std::filesystem::path& Recording::file() const noexcept { return state_->file; }
const RecordingHead& Recording::head() const noexcept { return state_->head; }
const RecordingColumns& Recording::columns() const noexcept { return state_->columns; }
const std::vector<RecordingEvent>& Recording::events() const noexcept { return state_->events; }
const std::vector<TickRun>& Recording::runs() const noexcept { return state_->runs; }
std::uint64_t Recording::tick_count() const noexcept { return state_->tick_count; }
void Recording::rewind() noexcept { state_->rows.reset(); }
std::unexpected<Error> Recording::damaged(std::string_view what) const { return state_->database.damaged(what); }

Result<bool> Recording::next(std::uint64_t& first, Bytes& rows) {
  State& s = *state_;
  if (!s.rows) {
    RELIEF_TRY(Statement get, s.database.prepare("SELECT first, count, hash, data FROM ticks ORDER BY first"));
    s.rows.emplace(std::move(get));
  }
  RELIEF_TRY(const bool row, s.rows->step());
  if (!row) {
    s.rows.reset();
    return false;
  }
  // Their sizes were looked at when the file was opened.
  const std::int64_t start = s.rows->integer(0), count = s.rows->integer(1);
  const Bytes blob = s.rows->blob(3);
  const std::size_t width = row_bytes(s.columns);
  const std::string place = "the batch of ticks from " + std::to_string(start);
  if (s.rows->integer(2) != hash_of(kTickStream, blob, start, count)) return damaged(place + " fails its checksum");
  s.batch.resize(static_cast<std::size_t>(count) * width);
  if (!detail::unpack(blob, width, s.batch)) return damaged(place + " cannot be unpacked");
  first = static_cast<std::uint64_t>(start);
  rows = s.batch;
  return true;
}

}  // namespace relief
