#include <relief/base/try.h>
#include <relief/file/checksum.h>
#include <relief/file/cut_database.h>
#include <relief/file/database.h>
#include <relief/file/recording.h>
#include <relief/file/tile_codec.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <tuple>

namespace relief {

namespace {

using detail::Bytes;
using detail::bytes_of;
using detail::CutDatabase;
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

std::string text_of(Bytes number, const RecordingColumn& column, NoneColumns or_none) {
  const bool none = column.type == NumberType::U32 &&
                    std::ranges::all_of(number, [](std::byte b) { return b == std::byte{0xff}; }) &&
                    std::ranges::find(or_none, column.name) != or_none.end();
  return none ? "-1" : text_of(number, column.type);
}

std::string_view RecordingHead::fact(std::string_view key) const noexcept {
  const auto found = facts.find(key);
  return found == facts.end() ? std::string_view() : found->second;
}

// ---- Writing

struct RecordingWriter::State {
  std::filesystem::path file;
  std::optional<Database> database;
  std::map<std::string, std::size_t, std::less<>> widths;
  std::uint64_t next_tick = 0;
  std::uint64_t added_ticks = 0, committed_ticks = 0;
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
  [[nodiscard]] Status commit(bool last = false) {
    if (!database->in_transaction()) return {};
    const Status done = database->run("COMMIT");
    if (done) committed_ticks = added_ticks;
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
};

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& file, RecordingHead head) {
  if (row_bytes(head.streams[std::string(kTickStream)]) == 0)
    return fail(Errc::InvalidArgument, "a recording needs columns for its ticks");
  auto state = std::make_unique<State>();
  state->file = file;
  RELIEF_TRY(Replacement made, Replacement::make(file, kKind));
  RELIEF_CHECK(state->open(made.file()));
  RELIEF_CHECK(state->begin());
  RELIEF_CHECK(state->database->write_tables());
  for (const auto& [key, value] : head.facts) RELIEF_CHECK(state->write_fact(key, value));
  for (const auto& [stream, columns] : head.streams) {
    RELIEF_CHECK(state->write_columns(stream, columns));
    state->widths[stream] = row_bytes(columns);
  }
  RELIEF_CHECK(state->commit(true));
  state->database.reset();
  RELIEF_CHECK(made.replace_target());
  RELIEF_CHECK(state->open(made.target()));
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
  RELIEF_CHECK(put.bind(static_cast<std::int64_t>(first))
                   .bind(static_cast<std::int64_t>(count))
                   .bind(hash_of(kTickStream, blob, first, count))
                   .bind(Bytes(blob))
                   .run());
  state_->added_ticks += count;
  return {};
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
  state_->database.reset();
  return {};
}

std::uint64_t RecordingWriter::committed_ticks() const noexcept { return state_->committed_ticks; }

// ---- Reading

/// A batch of ticks that lies in a file that was cut short.
struct WholeBatch {
  std::int64_t first = 0, count = 0, hash = 0;
  std::size_t bytes = 0;
  CutDatabase::Place place;
};

/// A row of the table of columns.
struct ColumnRow {
  std::string stream;
  std::int64_t position = 0;
  std::string name, type, unit, role;
  std::int64_t hash = 0;
};

/// A row of the table of events.
struct EventRow {
  std::int64_t number = 0;
  RecordingEvent event;
  std::int64_t hash = 0;
};

struct Recording::State {
  explicit State(std::filesystem::path path) : file(std::move(path)) {}

  std::filesystem::path file;
  std::optional<Database> database;
  RecordingHead head;
  RecordingColumns columns;
  std::vector<RecordingEvent> events;
  std::vector<TickRun> runs;
  std::uint64_t tick_count = 0;
  std::optional<Statement> rows;  ///< of the table of ticks, while they are read
  std::vector<std::byte> batch;
  // Of a file that was cut short, in place of the database.
  std::optional<Cut> cut;
  std::optional<CutDatabase> pages;
  std::vector<WholeBatch> batches;
  std::size_t next_batch = 0;
  CutDatabase::Row page_row;

  [[nodiscard]] std::unexpected<Error> damaged(std::string_view what) const {
    return fail(Errc::Corrupt, std::string("'").append(printable(file.string())).append("' is damaged: ").append(what));
  }

  // ---- One row each, checked; in the order of their keys

  [[nodiscard]] Status take_fact(std::string_view key, std::string_view value, std::int64_t hash) {
    if (hash != hash_of(key, bytes_of(value))) return damaged("its facts fail their checksum");
    head.facts.emplace(key, value);
    return {};
  }

  [[nodiscard]] Status take_column(const ColumnRow& row) {
    const auto type = type_from_name(row.type);
    RecordingColumns& to = head.streams[row.stream];
    if (!type || to.size() == kMaxColumns || head.streams.size() > kMaxColumns ||
        row.position != static_cast<std::int64_t>(to.size()))
      return damaged("its columns do not make sense");
    RecordingColumn column = {row.name, *type, row.unit, row.role};
    if (row.hash != hash_of(row.stream, row.position, column)) return damaged("its columns fail their checksum");
    if (std::ranges::find(to, row.name, &RecordingColumn::name) != to.end())
      return damaged("it has the column " + printable(row.name, 40) + " twice");
    to.push_back(std::move(column));
    return {};
  }

  [[nodiscard]] Status take_event(EventRow row) {
    const std::int64_t number = static_cast<std::int64_t>(events.size()) + 1;
    if (row.number != number) return damaged("event " + std::to_string(number) + " is missing");
    if (row.hash != hash_of(row.event.stream, row.event.row, number, row.event.at))
      return damaged("event " + std::to_string(number) + " fails its checksum");
    const auto stream = head.streams.find(row.event.stream);
    if ((stream == head.streams.end() ? 0 : row_bytes(stream->second)) != row.event.row.size())
      return damaged("event " + std::to_string(number) + " has not the size of its columns");
    events.push_back(std::move(row.event));
    return {};
  }

  /// That a batch of so many packed bytes may hold these ticks.
  [[nodiscard]] Status take_batch(std::int64_t first, std::int64_t count, std::size_t bytes) {
    const std::uint64_t end = runs.empty() ? 0 : runs.back().first + runs.back().count;
    if (first < 0 || first > kMaxTick || count < 1 || count > static_cast<std::int64_t>(RecordingWriter::kMaxBatch) ||
        static_cast<std::uint64_t>(first) < end ||
        static_cast<std::size_t>(count) * row_bytes(columns) / detail::kMaxExpansion > bytes)
      return damaged("the batch of ticks from " + std::to_string(first) + " does not make sense");
    if (!runs.empty() && end == static_cast<std::uint64_t>(first))
      runs.back().count += static_cast<std::uint64_t>(count);
    else
      runs.push_back({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(count)});
    tick_count += static_cast<std::uint64_t>(count);
    return {};
  }

  /// To be called when all columns have been taken.
  [[nodiscard]] Status find_tick_columns() {
    columns = head.streams[std::string(kTickStream)];
    return columns.empty() ? damaged("it does not say what its ticks are made of") : Status{};
  }

  // ---- All rows of a database

  [[nodiscard]] Status read_facts() {
    RELIEF_TRY(Statement get, database->prepare("SELECT key, value, hash FROM facts ORDER BY key"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      RELIEF_CHECK(take_fact(get.text(0), get.text(1), get.integer(2)));
    }
  }

  [[nodiscard]] Status read_columns() {
    RELIEF_TRY(Statement get, database->prepare("SELECT stream, position, name, type, unit, role, hash FROM columns "
                                                "ORDER BY stream, position"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return find_tick_columns();
      RELIEF_CHECK(
          take_column({std::string(get.text(0)), get.integer(1), std::string(get.text(2)), std::string(get.text(3)),
                       std::string(get.text(4)), std::string(get.text(5)), get.integer(6)}));
    }
  }

  [[nodiscard]] Status read_events() {
    RELIEF_TRY(Statement get, database->prepare("SELECT number, stream, at, hash, data FROM events ORDER BY number"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      const Bytes data = get.blob(4);
      RELIEF_CHECK(take_event(
          {get.integer(0),
           {std::string(get.text(1)), static_cast<std::uint64_t>(get.integer(2)), {data.begin(), data.end()}},
           get.integer(3)}));
    }
  }

  /// Returns which ticks there are, and that their batches may hold them.
  [[nodiscard]] Status read_runs() {
    RELIEF_TRY(Statement get, database->prepare("SELECT first, count, length(data) FROM ticks ORDER BY first"));
    for (;;) {
      RELIEF_TRY(const bool row, get.step());
      if (!row) return {};
      RELIEF_CHECK(take_batch(get.integer(0), get.integer(1), static_cast<std::size_t>(get.integer(2))));
    }
  }

  /// SQLite takes what is missing of the last page for zeros.
  [[nodiscard]] Status check_size() const {
    RELIEF_TRY(const std::int64_t pages_stated, database->integer("PRAGMA page_count"));
    RELIEF_TRY(const std::int64_t page_size, database->integer("PRAGMA page_size"));
    std::error_code code;
    const std::uintmax_t size = std::filesystem::file_size(file, code);
    return code || size >= static_cast<std::uintmax_t>(pages_stated * page_size) ? Status{}
                                                                                 : damaged("its last page is cut");
  }

  [[nodiscard]] Status read_database() {
    RELIEF_TRY(Database opened, Database::open(file, Database::Access::Read, kKind));
    database.emplace(std::move(opened));
    RELIEF_CHECK(database->check_format());
    RELIEF_CHECK(database->run("BEGIN"));  // one moment of a file that may still grow
    RELIEF_CHECK(database->check_tables());
    RELIEF_CHECK(check_size());
    RELIEF_CHECK(read_facts());
    RELIEF_CHECK(read_columns());
    RELIEF_CHECK(read_events());
    return read_runs();
  }

  // ---- What is whole in a file that was cut short: rows of all tables, as they lie

  [[nodiscard]] Status read_whole_rows() {
    std::vector<ColumnRow> column_rows;
    std::vector<EventRow> event_rows;
    using Type = Statement::Type;
    const auto is = [&](std::initializer_list<Type> types) {
      return std::ranges::equal(page_row.values, types, {}, &CutDatabase::Value::type);
    };
    const auto text = [&](std::size_t k) { return std::string(page_row.values[k].text()); };
    const auto integer = [&](std::size_t k) { return page_row.values[k].integer; };
    for (CutDatabase::Place at; pages->next(at, page_row);) {
      if (is({Type::Text, Type::Text, Type::Integer})) {
        static_cast<void>(take_fact(text(0), text(1), integer(2)));
      } else if (is({Type::Text, Type::Integer, Type::Text, Type::Text, Type::Text, Type::Text, Type::Integer})) {
        column_rows.push_back({text(0), integer(1), text(2), text(3), text(4), text(5), integer(6)});
      } else if (is({Type::Null, Type::Text, Type::Integer, Type::Integer, Type::Blob})) {
        const Bytes data = page_row.values[4].bytes;
        event_rows.push_back({page_row.number,
                              {text(1), static_cast<std::uint64_t>(integer(2)), {data.begin(), data.end()}},
                              integer(3)});
      } else if (is({Type::Null, Type::Integer, Type::Integer, Type::Blob})) {
        const WholeBatch found = {page_row.number, integer(1), integer(2), page_row.values[3].bytes.size(),
                                  page_row.place};
        if (found.hash == hash_of(kTickStream, page_row.values[3].bytes, found.first, found.count))
          batches.push_back(found);
      }
    }
    // The first that is missing ends each of them.
    std::ranges::sort(column_rows, {}, [](const ColumnRow& row) { return std::tie(row.stream, row.position); });
    for (const ColumnRow& row : column_rows) static_cast<void>(take_column(row));
    RELIEF_CHECK(find_tick_columns());
    std::ranges::sort(event_rows, {}, &EventRow::number);
    for (EventRow& row : event_rows)
      if (!take_event(std::move(row))) break;
    std::ranges::sort(batches, {}, &WholeBatch::first);
    std::erase_if(batches, [&](const WholeBatch& found) { return !take_batch(found.first, found.count, found.bytes); });
    return {};
  }

  /// Looks for what is whole where `failure` came of a cut.
  [[nodiscard]] Status read_what_is_whole(const Error& failure) {
    RELIEF_TRY(auto found, CutDatabase::open(file, kKind));
    if (!found) return std::unexpected(failure);
    pages.emplace(std::move(*found));
    cut = Cut{pages->bytes(), pages->whole_bytes()};
    if (read_whole_rows()) return {};
    return damaged("it was cut at " + std::to_string(cut->bytes) + " of " + std::to_string(cut->whole_bytes) +
                   " bytes, and nothing that is left of it can be repeated");
  }

  // ---- Batch by batch

  /// Returns the packed bytes of the next batch; false at the end.
  [[nodiscard]] Result<bool> next_packed(WholeBatch& now, Bytes& packed) {
    if (pages) {
      if (next_batch == batches.size()) return false;
      now = batches[next_batch++];
      if (!pages->read(now.place, page_row)) return damaged("it was changed while it was read");
      packed = page_row.values[3].bytes;
      return true;
    }
    if (!rows) {
      RELIEF_TRY(Statement get, database->prepare("SELECT first, count, hash, data FROM ticks ORDER BY first"));
      rows.emplace(std::move(get));
    }
    RELIEF_TRY(const bool row, rows->step());
    if (!row) return false;
    now = {rows->integer(0), rows->integer(1), rows->integer(2), 0, {}};
    packed = rows->blob(3);
    return true;
  }
  void rewind() noexcept {
    rows.reset();
    next_batch = 0;
  }
};

Recording::Recording(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;
Recording::~Recording() = default;

Result<Recording> Recording::open(const std::filesystem::path& file) {
  auto state = std::make_unique<State>(file);
  const Status read = state->read_database();
  if (read) return Recording(std::move(state));
  if (read.error().code != Errc::Corrupt) return std::unexpected(read.error());
  state = std::make_unique<State>(file);
  RELIEF_CHECK(state->read_what_is_whole(read.error()));
  return Recording(std::move(state));
}

const std::filesystem::path& Recording::file() const noexcept { return state_->file; }
const RecordingHead& Recording::head() const noexcept { return state_->head; }
const RecordingColumns& Recording::columns() const noexcept { return state_->columns; }
const std::vector<RecordingEvent>& Recording::events() const noexcept { return state_->events; }
const std::vector<TickRun>& Recording::runs() const noexcept { return state_->runs; }
std::uint64_t Recording::tick_count() const noexcept { return state_->tick_count; }
const std::optional<Recording::Cut>& Recording::cut() const noexcept { return state_->cut; }
void Recording::rewind() noexcept { state_->rewind(); }
std::unexpected<Error> Recording::damaged(std::string_view what) const { return state_->damaged(what); }

Result<bool> Recording::next(std::uint64_t& first, Bytes& rows) {
  State& s = *state_;
  WholeBatch now;
  Bytes packed;
  RELIEF_TRY(const bool more, s.next_packed(now, packed));
  if (!more) {
    s.rewind();
    return false;
  }
  // Their sizes were looked at when the file was opened.
  const std::size_t width = row_bytes(s.columns);
  const std::string place = "the batch of ticks from " + std::to_string(now.first);
  if (now.hash != hash_of(kTickStream, packed, now.first, now.count)) return damaged(place + " fails its checksum");
  s.batch.resize(static_cast<std::size_t>(now.count) * width);
  if (!detail::unpack(packed, width, s.batch)) return damaged(place + " cannot be unpacked");
  first = static_cast<std::uint64_t>(now.first);
  rows = s.batch;
  return true;
}

}  // namespace relief
