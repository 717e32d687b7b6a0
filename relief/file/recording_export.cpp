#include <relief/base/atomic_file.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/file/recording.h>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstring>

namespace relief {

namespace {

using Bytes = std::span<const std::byte>;

std::vector<std::size_t> offsets_of(const RecordingColumns& columns) {
  std::vector<std::size_t> offsets;
  std::size_t at = 0;
  for (const RecordingColumn& column : columns) {
    offsets.push_back(at);
    at += bytes_of(column.type);
  }
  return offsets;
}

// ---- JSON

/// Text between quotes. What is no UTF-8 or a control character is escaped first.
std::string json_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : printable(text, 4096)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

/// A column's place in the message: names with dots are objects inside objects.
struct Property {
  std::string name;
  std::vector<Property> parts;
  std::size_t column = 0;  ///< of a property without parts
};

void place(std::vector<Property>& among, std::string_view name, std::size_t column) {
  const std::size_t dot = name.find('.');
  const std::string first(name.substr(0, dot));
  if (dot == std::string_view::npos) {
    among.push_back({first, {}, column});
    return;
  }
  if (among.empty() || among.back().name != first || among.back().parts.empty()) among.push_back({first, {}, column});
  place(among.back().parts, name.substr(dot + 1), column);
}

/// Returns the members of a schema's "properties".
std::string schema_of(const std::vector<Property>& properties, const RecordingColumns& columns) {
  std::string out;
  for (const Property& p : properties) {
    if (!out.empty()) out += ',';
    out += json_text(p.name) + ':';
    if (!p.parts.empty()) {
      out += R"({"type":"object","properties":{)" + schema_of(p.parts, columns) + "}}";
      continue;
    }
    const RecordingColumn& column = columns[p.column];
    const bool real = column.type == NumberType::F64 || column.type == NumberType::F32;
    out += real ? R"({"type":["number","null"])" : R"({"type":"integer")";
    if (!column.unit.empty()) out += ",\"description\":" + json_text(column.unit);
    out += '}';
  }
  return out;
}

/// The members of a message, each after a comma or a brace.
void write_message(const std::vector<Property>& properties, const RecordingColumns& columns,
                   const std::vector<std::size_t>& offsets, NoneColumns or_none, Bytes row, std::string& out) {
  for (const Property& p : properties) {
    if (out.back() != '{') out += ',';
    out += json_text(p.name) + ':';
    if (!p.parts.empty()) {
      out += '{';
      write_message(p.parts, columns, offsets, or_none, row, out);
      out += '}';
      continue;
    }
    const RecordingColumn& column = columns[p.column];
    const std::string number = text_of(row.subspan(offsets[p.column], bytes_of(column.type)), column, or_none);
    out += number.find_first_of("ni") == std::string::npos ? number : "null";  // nan, inf
  }
}

// ---- MCAP: records of an opcode, a length and a content; see https://mcap.dev/spec

enum class Op : std::uint8_t {
  Header = 1,
  Footer,
  Schema,
  Channel,
  Message,
  Chunk,
  MessageIndex,
  ChunkIndex,
  Statistics = 11,
  Metadata,
  MetadataIndex,
  SummaryOffset,
  DataEnd
};

constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::uint16_t kSchema = 1, kChannel = 1;
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

/// The content of a record, field by field.
class Content {
 public:
  template <std::unsigned_integral T>
  Content& number(T value) {
    for (std::size_t k = 0; k < sizeof value; ++k)
      bytes_ += static_cast<char>(static_cast<unsigned char>(value >> (8 * k)));
    return *this;
  }
  /// Returns a string, or bytes, arrays and maps that are already in their form.
  Content& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    return raw(text);
  }
  Content& map(const std::map<std::string, std::string, std::less<>>& entries) {
    Content inner;
    for (const auto& [key, value] : entries) inner.text(key).text(printable(value, 4096));
    return text(inner.bytes_);
  }
  Content& raw(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::string record(Op op) const {
    Content head;
    head.number(static_cast<std::uint8_t>(op)).number(std::uint64_t{bytes_.size()});
    return head.bytes_ + bytes_;
  }

 private:
  std::string bytes_;
};

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Messages into chunks, each followed by its index; the summary repeats what a reader needs to find them.
class McapWriter {
 public:
  explicit McapWriter(AtomicFile& out) : out_(out) {}

  Status begin(std::string_view schema, const RecordingHead& head) {
    definitions_ =
        Content().number(kSchema).text("relief.Tick").text("jsonschema").text(schema).record(Op::Schema) +
        Content().number(kChannel).number(kSchema).text("/relief/tick").text("json").map({}).record(Op::Channel);
    RELIEF_CHECK(write(kMagic));
    RELIEF_CHECK(write(Content().text("").text("Relief").record(Op::Header)));
    metadata_at_ = at_;
    RELIEF_CHECK(write(Content().text("recording").map(head.facts).record(Op::Metadata)));
    metadata_bytes_ = at_ - metadata_at_;
    chunk_ = definitions_;
    return {};
  }

  Status message(std::uint64_t time, std::string_view json) {
    if (in_chunk_ == 0) chunk_start_ = chunk_end_ = time;
    if (messages_ == 0) first_time_ = time;
    chunk_start_ = std::min(chunk_start_, time);
    chunk_end_ = std::max(chunk_end_, time);
    first_time_ = std::min(first_time_, time);
    last_time_ = std::max(last_time_, time);
    index_.number(time).number(std::uint64_t{chunk_.size()});
    chunk_ += Content()
                  .number(kChannel)
                  .number(static_cast<std::uint32_t>(messages_))
                  .number(time)
                  .number(time)
                  .raw(json)
                  .record(Op::Message);
    ++in_chunk_;
    ++messages_;
    return chunk_.size() < kChunkBytes ? Status{} : end_chunk();
  }

  Status finish() {
    RELIEF_CHECK(end_chunk());
    RELIEF_CHECK(write(Content().number(std::uint32_t{0}).record(Op::DataEnd)));
    const std::uint64_t summary_at = at_;
    std::string summary;
    Content offsets;
    const auto group = [&](Op op, const std::string& records) {
      if (records.empty()) return;
      offsets.raw(Content()
                      .number(static_cast<std::uint8_t>(op))
                      .number(summary_at + summary.size())
                      .number(std::uint64_t{records.size()})
                      .record(Op::SummaryOffset));
      summary += records;
    };
    const std::size_t channel_at = schema_bytes();
    group(Op::Schema, definitions_.substr(0, channel_at));
    group(Op::Channel, definitions_.substr(channel_at));
    Content counts;
    if (messages_ != 0) counts.number(kChannel).number(messages_);
    group(Op::Statistics, Content()
                              .number(messages_)
                              .number(std::uint16_t{1})
                              .number(std::uint32_t{1})
                              .number(std::uint32_t{0})
                              .number(std::uint32_t{1})
                              .number(chunks_)
                              .number(first_time_)
                              .number(last_time_)
                              .text(counts.bytes())
                              .record(Op::Statistics));
    group(Op::ChunkIndex, chunk_indexes_);
    group(Op::MetadataIndex,
          Content().number(metadata_at_).number(metadata_bytes_).text("recording").record(Op::MetadataIndex));
    const std::uint64_t offsets_at = summary_at + summary.size();
    summary += offsets.bytes();
    // The checksum covers the summary, its offsets, and the footer up to the checksum itself.
    summary += Content().number(static_cast<std::uint8_t>(Op::Footer)).number(std::uint64_t{20}).bytes();
    summary += Content().number(summary_at).number(offsets_at).bytes();
    RELIEF_CHECK(write(summary));
    RELIEF_CHECK(write(Content().number(crc_of(summary)).bytes()));
    return write(kMagic);
  }

 private:
  Status write(std::string_view bytes) {
    at_ += bytes.size();
    return out_.write(bytes);
  }
  [[nodiscard]] std::size_t schema_bytes() const noexcept {
    std::uint64_t length = 0;
    std::memcpy(&length, definitions_.data() + 1, sizeof length);
    return 9 + static_cast<std::size_t>(length);
  }

  Status end_chunk() {
    if (chunk_.empty()) return {};
    const std::uint64_t chunk_at = at_, size = chunk_.size();
    RELIEF_CHECK(write(Content()
                           .number(chunk_start_)
                           .number(chunk_end_)
                           .number(size)
                           .number(crc_of(chunk_))
                           .text("")
                           .number(size)
                           .raw(chunk_)
                           .record(Op::Chunk)));
    const std::uint64_t index_at = at_;
    Content places;
    if (in_chunk_ != 0) {
      RELIEF_CHECK(write(Content().number(kChannel).text(index_.bytes()).record(Op::MessageIndex)));
      places.number(kChannel).number(index_at);
    }
    chunk_indexes_ += Content()
                          .number(chunk_start_)
                          .number(chunk_end_)
                          .number(chunk_at)
                          .number(index_at - chunk_at)
                          .text(places.bytes())
                          .number(at_ - index_at)
                          .text("")
                          .number(size)
                          .number(size)
                          .record(Op::ChunkIndex);
    ++chunks_;
    chunk_.clear();
    index_ = {};
    in_chunk_ = chunk_start_ = chunk_end_ = 0;
    return {};
  }

  AtomicFile& out_;
  std::uint64_t at_ = 0;     ///< bytes written
  std::string definitions_;  ///< the schema, then the channel
  std::string chunk_;        ///< records of the open chunk; the first one begins with the definitions
  Content index_;            ///< of the open chunk
  std::string chunk_indexes_;
  std::uint64_t metadata_at_ = 0, metadata_bytes_ = 0;
  std::uint64_t in_chunk_ = 0, chunk_start_ = 0, chunk_end_ = 0;
  std::uint64_t messages_ = 0, first_time_ = 0, last_time_ = 0;
  std::uint32_t chunks_ = 0;
};

/// Calls visit(number, row) -> Status for every tick that is written to `file`.
template <typename Visit>
Status for_each_tick(Recording& recording, const std::filesystem::path& file, const Progress& progress, Visit&& visit) {
  const std::size_t width = row_bytes(recording.columns());
  Steps steps(progress, "export", recording.tick_count());
  recording.rewind();
  for (;;) {
    std::uint64_t first = 0;
    Bytes rows;
    RELIEF_TRY(const bool more, recording.next(first, rows));
    if (!more) return {};
    for (std::size_t k = 0; k * width < rows.size(); ++k) {
      RELIEF_CHECK(visit(first + k, rows.subspan(k * width, width)));
      if (!steps.next()) return fail(Errc::Cancelled, printable(file.string()) + ": not written, for it was cancelled");
    }
  }
}

}  // namespace

Status export_csv(Recording& recording, const std::filesystem::path& file, NoneColumns or_none,
                  const Progress& progress) {
  const RecordingColumns& columns = recording.columns();
  const std::vector<std::size_t> offsets = offsets_of(columns);
  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  std::string line = "tick";
  for (const RecordingColumn& column : columns) {
    std::string title = printable(column.name) + (column.unit.empty() ? "" : " [" + printable(column.unit) + "]");
    std::ranges::replace(title, ',', ';');
    line += ',' + title;
  }
  RELIEF_CHECK(out.write(line + '\n'));
  RELIEF_CHECK(for_each_tick(recording, file, progress, [&](std::uint64_t number, Bytes row) -> Status {
    line = std::to_string(number);
    for (std::size_t k = 0; k < columns.size(); ++k)
      line += ',' + text_of(row.subspan(offsets[k], bytes_of(columns[k].type)), columns[k], or_none);
    return out.write(line += '\n');
  }));
  return out.commit();
}

Status export_mcap(Recording& recording, const std::filesystem::path& file, NoneColumns or_none,
                   const Progress& progress) {
  const RecordingColumns& columns = recording.columns();
  const std::vector<std::size_t> offsets = offsets_of(columns);
  std::vector<Property> properties;
  for (std::size_t k = 0; k < columns.size(); ++k) place(properties, columns[k].name, k);
  const auto clock = std::ranges::find_if(
      columns, [](const RecordingColumn& c) { return c.name == "t" && c.type == NumberType::F64; });
  const auto clock_column = static_cast<std::size_t>(clock - columns.begin());

  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  McapWriter mcap(out);
  RELIEF_CHECK(
      mcap.begin(R"({"type":"object","properties":{"tick":{"type":"integer"},)" + schema_of(properties, columns) + "}}",
                 recording.head()));
  std::uint64_t time = 0;
  std::string json;
  RELIEF_CHECK(for_each_tick(recording, file, progress, [&](std::uint64_t number, Bytes row) -> Status {
    // The device's clock where it runs on, else it stands still.
    double t = 0;
    if (clock_column < columns.size()) std::memcpy(&t, row.data() + offsets[clock_column], sizeof t);
    if (t > 0 && t < 9e9) time = std::max(time, static_cast<std::uint64_t>(std::llround(t * 1e9)));
    json = R"({"tick":)" + std::to_string(number);
    write_message(properties, columns, offsets, or_none, row, json);
    return mcap.message(time, json += '}');
  }));
  RELIEF_CHECK(mcap.finish());
  return out.commit();
}

}  // namespace relief
