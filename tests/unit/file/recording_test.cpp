// Recordings as files: what is written comes back, what a killed writer left is kept, what is damaged is refused.
#include <relief/file/checksum.h>
#include <relief/file/recording.h>
#include <relief/file/tile_codec.h>

#include <sqlite3.h>
#include <support/canceller.h>
#include <sys/wait.h>
#include <unit/file/file_support.h>

#include <algorithm>
#include <array>
#include <bit>
#include <csignal>
#include <cstring>
#include <limits>

namespace relief {
namespace {

using testing::Folder;
using testing::read_file;
using testing::write_file;

constexpr std::size_t kWidth = 8 + 4 + 1;

RecordingHead head() {
  RecordingHead head;
  head.facts = {{"program", "test"}, {"odd \"key\"", "a\nb"}};
  head.streams = {{std::string(kTickStream),
                   {{"t", NumberType::F64, "s", "input"},
                    {"force.x", NumberType::F32, "N", "output"},
                    {"contact", NumberType::U8, "", "output"}}},
                  {"settings", {{"stiffness", NumberType::F64, "N/m", "input"}}}};
  return head;
}

std::vector<std::byte> rows(std::uint64_t first, std::size_t count) {
  std::vector<std::byte> bytes(count * kWidth);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint64_t number = first + k;
    const double t = static_cast<double>(number) * 1e-3;
    const float force = std::sin(static_cast<float>(number) * 0.01F);
    std::byte* row = bytes.data() + k * kWidth;
    std::memcpy(row, &t, sizeof t);
    std::memcpy(row + 8, &force, sizeof force);
    row[12] = std::byte(number % 2);
  }
  return bytes;
}

/// 1000 ticks in batches of 100; ticks 400 to 449 are missing.
void make(const std::filesystem::path& file) {
  RELIEF_MUST(writer, RecordingWriter::create(file, head()));
  EXPECT_OK(writer.add_event({"settings", 3, std::vector<std::byte>(8, std::byte{1})}));
  for (std::uint64_t first = 0; first < 1000; first += 100) {
    if (first == 400)
      EXPECT_OK(writer.add_ticks(450, rows(450, 50)));
    else
      EXPECT_OK(writer.add_ticks(first, rows(first, 100)));
  }
  EXPECT_OK(writer.finish({{"end", "stopped"}}));
}

/// Reads all of a recording; the error if there is one.
Status read_all(const std::filesystem::path& file, std::vector<std::byte>* all = nullptr) {
  auto recording = Recording::open(file);
  if (!recording) return std::unexpected(recording.error());
  std::uint64_t first = 0;
  for (std::span<const std::byte> batch;;) {
    const auto more = recording->next(first, batch);
    if (!more) return std::unexpected(more.error());
    if (!*more) return {};
    if (all != nullptr) all->insert(all->end(), batch.begin(), batch.end());
  }
}

TEST(Recording, ComesBackAsItWasWritten) {
  const Folder folder;
  make(folder / "a.rlog");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.rlog"});
  RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
  EXPECT_EQ(recording.columns(), head().streams[std::string(kTickStream)]);
  EXPECT_EQ(recording.head().fact("odd \"key\""), "a\nb");
  EXPECT_EQ(recording.head().fact("end"), "stopped");
  EXPECT_EQ(recording.head().fact("none"), "");
  ASSERT_EQ(recording.events().size(), 1U);
  EXPECT_EQ(recording.events()[0].at, 3U);
  ASSERT_EQ(recording.runs().size(), 2U);
  EXPECT_EQ(recording.runs()[0].count, 400U);
  EXPECT_EQ(recording.runs()[1].first, 450U);
  EXPECT_EQ(recording.runs()[1].count, 550U);
  EXPECT_EQ(recording.tick_count(), 950U);
  std::vector<std::byte> wanted = rows(0, 400), found;
  const std::vector<std::byte> rest = rows(450, 550);
  wanted.insert(wanted.end(), rest.begin(), rest.end());
  EXPECT_OK(read_all(folder / "a.rlog", &found));
  EXPECT_EQ(found, wanted);
}

TEST(Recording, RefusesWhatIsOutOfOrder) {
  const Folder folder;
  RELIEF_MUST(writer, RecordingWriter::create(folder / "a.rlog", head()));
  EXPECT_OK(writer.add_ticks(10, rows(10, 5)));
  EXPECT_FALSE(writer.add_ticks(14, rows(14, 1)));
  const std::vector<std::byte> two = rows(20, 2);
  EXPECT_FALSE(writer.add_ticks(20, std::span(two).first(kWidth + 3)));
  EXPECT_FALSE(writer.add_event({"nothing", 0, {}}));
  EXPECT_FALSE(writer.add_event({"settings", 0, {}}));
  EXPECT_FALSE(RecordingWriter::create(folder / "b.rlog", {}));
}

TEST(Recording, WhatAKilledWriterCommittedIsThere) {
  const Folder folder;
  const auto file = folder / "a.rlog";
  for (int round = 0; round < 20; ++round) {
    std::array<int, 2> pipe{};
    ASSERT_EQ(::pipe(pipe.data()), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto writer = RecordingWriter::create(file, head());
      for (std::uint64_t done = 0; writer; done += 50) {
        if (!writer->add_ticks(done, rows(done, 50)) || !writer->commit()) break;
        const std::uint64_t committed = done + 50;
        if (::write(pipe[1], &committed, sizeof committed) != sizeof committed) break;
      }
      ::_exit(1);
    }
    ::close(pipe[1]);
    std::uint64_t committed = 0;
    ASSERT_EQ(::read(pipe[0], &committed, sizeof committed), static_cast<ssize_t>(sizeof committed));
    ::usleep(static_cast<useconds_t>((round * 7919) % 20000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    for (std::uint64_t more = 0; ::read(pipe[0], &more, sizeof more) == static_cast<ssize_t>(sizeof more);)
      committed = more;
    ::close(pipe[0]);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself";
    std::vector<std::byte> found;
    EXPECT_OK(read_all(file, &found));
    EXPECT_GE(found.size(), committed * kWidth);
    EXPECT_EQ(found, rows(0, found.size() / kWidth));
  }
}

TEST(Recording, ItGrowsWhileItIsRead) {
  const Folder folder;
  RELIEF_MUST(writer, RecordingWriter::create(folder / "a.rlog", head()));
  EXPECT_OK(writer.add_ticks(0, rows(0, 10)));
  EXPECT_OK(writer.commit());
  {
    RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
    EXPECT_EQ(recording.tick_count(), 10U);
    EXPECT_OK(writer.add_ticks(10, rows(10, 10)));
    EXPECT_OK(writer.commit());  // waits for its turn: the next commit carries it
  }
  EXPECT_OK(writer.finish({}));
  RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
  EXPECT_EQ(recording.tick_count(), 20U);
}

/// A recording that is whole: its file, the bytes of that, and the ticks in them.
struct Sound {
  Folder folder;
  std::filesystem::path file = folder / "a.rlog";
  std::string bytes;
  std::vector<std::byte> ticks;

  Sound() {
    make(file);
    bytes = read_file(file);
    EXPECT_OK(read_all(file, &ticks));
  }
};

TEST(Recording, DamagedBytesAreFoundOrHarmless) {
  const Sound made;
  const auto& [folder, file, sound, wanted] = made;
  int refused = 0;
  for (std::size_t at = 0; at < sound.size(); at += 61) {
    std::string bytes = sound;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    write_file(file, bytes);
    std::vector<std::byte> found;
    const Status read = read_all(file, &found);
    if (read) {
      EXPECT_EQ(found, wanted) << "byte " << at;
      continue;
    }
    ++refused;
    EXPECT_NE(read.error().message.find("a.rlog"), std::string::npos) << read.error().message;
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
  EXPECT_GT(refused, 50);
}

/// How many ticks of a file are read when it is cut there: always the first ones, as they were; -1 where it is refused.
int whole_ticks(const std::filesystem::path& file, std::string_view bytes, const std::vector<std::byte>& wanted,
                std::size_t width) {
  write_file(file, std::string(bytes));
  std::vector<std::byte> found;
  const Status read = read_all(file, &found);
  if (!read) {
    EXPECT_TRUE(read.error().code == Errc::Corrupt || read.error().code == Errc::UnsupportedFormat) << bytes.size();
    EXPECT_NE(read.error().message.find(file.filename().string()), std::string::npos) << read.error().message;
    return -1;
  }
  EXPECT_LE(found.size(), wanted.size());
  EXPECT_TRUE(std::equal(found.begin(), found.end(), wanted.begin())) << "cut at " << bytes.size();
  return static_cast<int>(found.size() / width);
}

TEST(Recording, OneThatIsCutShortIsReadAsFarAsItIsWhole) {
  const Folder folder;
  const auto file = folder / "a.rlog";
  // Batches of noise, each some pages long; the tree over them has three levels: its root is cut off first.
  RecordingHead one;
  one.streams = {{std::string(kTickStream), {{"noise", NumberType::U64, "", "input"}}}};
  std::vector<std::byte> wanted;
  std::uint64_t noise = 1;
  {
    RELIEF_MUST(writer, RecordingWriter::create(file, one));
    for (std::uint64_t batch = 0; batch < 1200; ++batch) {
      std::vector<std::byte> rows;
      for (std::size_t k = 0; k < (batch % 3 == 0 ? 900 : 150); ++k) {
        noise = noise * 6364136223846793005U + 1442695040888963407U;
        const auto bytes = std::as_bytes(std::span(&noise, 1));
        rows.insert(rows.end(), bytes.begin(), bytes.end());
      }
      EXPECT_OK(writer.add_ticks(wanted.size() / 8, rows));
      wanted.insert(wanted.end(), rows.begin(), rows.end());
      if (batch % 100 == 0) EXPECT_OK(writer.commit());
    }
    EXPECT_OK(writer.finish({{"end", "stopped"}}));
  }
  const std::string sound = read_file(file);
  ASSERT_GT(sound.size(), 3'000'000U);
  int last = -1;
  for (std::size_t part = 1; part <= 64; ++part) {
    const std::size_t size = sound.size() * part / 64 - 1;
    const int ticks = whole_ticks(file, std::string_view(sound).substr(0, size), wanted, 8);
    EXPECT_GE(ticks, last) << size;
    // A batch and some pages of the tree may be lost at the end.
    EXPECT_GE(ticks, static_cast<int>(size / 9) - 4000) << "of " << wanted.size() / 8;
    last = ticks;
    RELIEF_MUST(recording, Recording::open(file));
    ASSERT_TRUE(recording.cut());
    EXPECT_EQ(recording.cut()->bytes, size);
    EXPECT_EQ(recording.cut()->whole_bytes, sound.size());
  }
  // A batch that is damaged besides is left out, as if it were cut off.
  std::string damaged = sound.substr(0, sound.size() - 1);
  damaged[sound.size() / 2 + 100] = static_cast<char>(damaged[sound.size() / 2 + 100] ^ 1);
  write_file(file, damaged);
  RELIEF_MUST(gappy, Recording::open(file));
  EXPECT_EQ(gappy.runs().size(), 2U);
  EXPECT_OK(read_all(file));
  write_file(file, sound);
  RELIEF_MUST(whole, Recording::open(file));
  EXPECT_FALSE(whole.cut());
}

TEST(Recording, EveryCutIsReadOrRefusedWithASentence) {
  const Sound made;
  const auto& [folder, file, sound, wanted] = made;
  int last = -1, refused = 0;
  for (std::size_t size = 0; size < sound.size(); size += 97) {
    const int ticks = whole_ticks(file, std::string_view(sound).substr(0, size), wanted, kWidth);
    EXPECT_GE(ticks, last) << size;
    refused += ticks < 0 ? 1 : 0;
    last = ticks;
  }
  EXPECT_LT(static_cast<double>(refused), 0.6 * static_cast<double>(sound.size()) / 97) << "it is mostly head";
  EXPECT_GT(last, 0);
}

TEST(Recording, DamagedBytesOfACutFileAreFoundOrHarmless) {
  const Sound made;
  const auto& [folder, file, sound, wanted] = made;
  for (std::size_t at = 0; at + 600 < sound.size(); at += 13) {
    std::string bytes = sound.substr(0, sound.size() - 600);
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    write_file(file, bytes);
    auto recording = Recording::open(file);
    if (!recording) continue;
    // Batches that are whole, each of them as it was.
    std::uint64_t first = 0;
    for (std::span<const std::byte> batch;;) {
      const auto more = recording->next(first, batch);
      if (!more || !*more) break;
      const std::vector<std::byte> expected = rows(first, batch.size() / kWidth);
      ASSERT_TRUE(std::ranges::equal(batch, expected)) << at;
    }
  }
}

TEST(Recording, ForgedRecordingsAreRefusedBeforeMemoryIsTaken) {
  const Folder folder;
  const auto file = folder / "a.rlog";
  const auto sum = [](const char* stream, std::span<const std::byte> data, std::int64_t first, std::int64_t count) {
    return std::to_string(detail::hash_of(stream, data, first, count));
  };
  const auto hash_column = [](std::int64_t position, const char* name, const char* type) {
    return std::to_string(detail::hash_of(std::string("tick/") + name + '/' + type + "/s",
                                          detail::bytes_of(std::string_view("input")), position));
  };
  const std::vector<std::byte> nothing;
  const std::vector<std::pair<std::string, std::string>> forgeries = {
      {"PRAGMA application_id = 7", "not a .rlog"},
      {"PRAGMA user_version = 99", "newer"},
      {"PRAGMA user_version = 0", "format version is 0"},
      {"CREATE TABLE more(x)", "tables"},
      {"DROP TABLE events", "lacks a table"},
      {"DELETE FROM columns", "what its ticks are made of"},
      {"UPDATE columns SET type = 'text' WHERE position = 1", "columns"},
      {"UPDATE columns SET position = 9 WHERE stream = 'tick' AND position = 2", "columns"},
      {"UPDATE columns SET unit = 'lb' WHERE position = 1", "checksum"},
      {"UPDATE columns SET name = 't', unit = 's', type = 'f64', role = 'input', hash = " + hash_column(1, "t", "f64") +
           " WHERE stream = 'tick' AND position = 1",
       "twice"},
      {"UPDATE facts SET value = 'other' WHERE key = 'program'", "checksum"},
      {"UPDATE events SET at = 4", "checksum"},
      {"UPDATE events SET number = 2", "missing"},
      {"UPDATE events SET data = x'', hash = " + std::to_string(detail::hash_of("settings", nothing, 1, 3)),
       "size of its columns"},
      {"UPDATE ticks SET count = 4000000000 WHERE first = 100", "does not make sense"},
      {"UPDATE ticks SET count = -1 WHERE first = 100", "does not make sense"},
      {"UPDATE ticks SET count = 101 WHERE first = 100", "does not make sense"},
      {"UPDATE ticks SET first = 9223372036854775807 WHERE first = 900", "does not make sense"},
      {"UPDATE ticks SET count = 4096, data = x'00', hash = " + sum("tick", nothing, 900, 4096) + " WHERE first = 900",
       "does not make sense"},
      {"UPDATE ticks SET count = 99 WHERE first = 100", "checksum"},
      {"UPDATE ticks SET data = x'', hash = " + sum("tick", nothing, 900, 1) + ", count = 1 WHERE first = 900",
       "cannot be unpacked"},
  };
  for (const auto& [sql, words] : forgeries) {
    make(file);
    sqlite3* handle = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(handle);
    const Status read = read_all(file);
    ASSERT_FALSE(read) << sql;
    EXPECT_NE(read.error().message.find(words), std::string::npos) << sql << ": " << read.error().message;
  }
}

TEST(Recording, AModelIsNoRecordingAndTheOtherWayRound) {
  const Folder folder;
  make(folder / "a.rlog");
  const auto opened = ModelFile::open(folder / "a.rlog", true);
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("is not a .relief file"), std::string::npos);
  EXPECT_OK(ModelFile::create(folder / "a.relief", testing::ball(1, 4)));
  const auto recording = Recording::open(folder / "a.relief");
  ASSERT_FALSE(recording);
  EXPECT_NE(recording.error().message.find("is not a .rlog file"), std::string::npos);
}

TEST(Recording, ItReplacesWhatStandsInItsPlaceAndIsThereAtOnce) {
  const Folder folder;
  write_file(folder / "a.rlog", "something else");
  {
    RELIEF_MUST(writer, RecordingWriter::create(folder / "a.rlog", head()));
    EXPECT_OK(writer.add_ticks(0, rows(0, 10)));
    EXPECT_EQ(writer.committed_ticks(), 0U);
    EXPECT_OK(writer.commit());
    EXPECT_EQ(writer.committed_ticks(), 10U);
    EXPECT_OK(writer.add_ticks(10, rows(10, 10)));
  }
  RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
  EXPECT_EQ(recording.tick_count(), 10U) << "what was committed";
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.rlog"});
}

TEST(Recording, CsvHasUnitsAndTheShortestNumbers) {
  const Folder folder;
  make(folder / "a.rlog");
  RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
  EXPECT_OK(export_csv(recording, folder / "a.csv"));
  const std::string text = read_file(folder / "a.csv");
  EXPECT_TRUE(text.starts_with("tick,t [s],force.x [N],contact\n0,0,0,0\n1,0.001,0.009999833,1\n"))
      << text.substr(0, 80);
  EXPECT_EQ(std::ranges::count(text, '\n'), 951);
  EXPECT_NE(text.find("\n450,0.45,"), std::string::npos);
  EXPECT_EQ(text.find("\n449,"), std::string::npos);
}

TEST(Recording, AnExportTellsItsShareAndLeavesNoFileWhenItIsCancelled) {
  const Folder folder;
  make(folder / "a.rlog");
  RELIEF_MUST(recording, Recording::open(folder / "a.rlog"));
  for (const auto write : {export_csv, export_mcap}) {
    const int stopped = testing::times_stopped(
        [&](const Progress& progress) { return testing::code(write(recording, folder / "out", {}, progress)); },
        [&] { EXPECT_EQ(folder.names(), std::vector<std::string>{"a.rlog"}); }, 101);
    EXPECT_GT(stopped, 50);
    EXPECT_TRUE(std::filesystem::remove(folder / "out"));
  }
}

TEST(NumberText, NoneIsMinusOneWhereAColumnMayHaveNone) {
  const std::array<std::string_view, 1> or_none = {"slab"};
  const std::uint32_t none = 0xffffffffU, some = 7;
  const auto bytes = [](const std::uint32_t& number) { return std::as_bytes(std::span(&number, 1)); };
  const RecordingColumn slab = {"slab", NumberType::U32, "", ""}, flags = {"flags", NumberType::U32, "", ""};
  EXPECT_EQ(text_of(bytes(none), slab, or_none), "-1");
  EXPECT_EQ(text_of(bytes(some), slab, or_none), "7");
  EXPECT_EQ(text_of(bytes(none), flags, or_none), "4294967295");
}

TEST(NumberText, GivesTheSameBitsBack) {
  for (const double value : {0.1, -0.0, 1e-310, 1.7976931348623157e308, std::numeric_limits<double>::infinity()}) {
    const std::string text = text_of(std::as_bytes(std::span(&value, 1)), NumberType::F64);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(std::strtod(text.c_str(), nullptr)), std::bit_cast<std::uint64_t>(value));
  }
  const std::uint64_t large = ~std::uint64_t{0};
  EXPECT_EQ(text_of(std::as_bytes(std::span(&large, 1)), NumberType::U64), "18446744073709551615");
}

}  // namespace
}  // namespace relief
