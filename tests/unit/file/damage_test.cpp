// Files that are cut, altered or made to mislead: each opens as it was, or is refused with a sentence.
#include <relief/base/hash.h>
#include <relief/file/tile_codec.h>

#include <sqlite3.h>
#include <sys/stat.h>
#include <unit/file/file_support.h>

#include <atomic>
#include <bit>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <set>

namespace relief {
namespace {

using testing::ball;
using testing::dab;
using testing::Folder;
using testing::read_file;
using testing::stroke;
using testing::write_file;

/// Changes a file by SQL, as somebody who knows the format could.
class Forger {
 public:
  explicit Forger(const std::filesystem::path& file) { EXPECT_EQ(sqlite3_open(file.c_str(), &handle_), SQLITE_OK); }
  Forger(const Forger&) = delete;
  Forger& operator=(const Forger&) = delete;
  ~Forger() {
    seal();
    sqlite3_close(handle_);
  }
  void run(const std::string& sql) {
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
  }
  /// Puts other bytes into a blob of `table`, with a checksum that holds.
  void put(const std::string& table, const std::string& where, const std::vector<std::byte>& data) {
    sqlite3_stmt* update = nullptr;
    const std::string sql = "UPDATE " + table + " SET data = ? WHERE " + where;
    ASSERT_EQ(sqlite3_prepare_v2(handle_, sql.c_str(), -1, &update, nullptr), SQLITE_OK);
    sqlite3_bind_blob(update, 1, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    EXPECT_EQ(sqlite3_step(update), SQLITE_DONE);
    sqlite3_finalize(update);
  }
  [[nodiscard]] std::vector<std::byte> blob(const std::string& sql) {
    sqlite3_stmt* select = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(handle_, sql.c_str(), -1, &select, nullptr), SQLITE_OK);
    EXPECT_EQ(sqlite3_step(select), SQLITE_ROW);
    const auto* bytes = static_cast<const std::byte*>(sqlite3_column_blob(select, 0));
    std::vector<std::byte> found(bytes, bytes + sqlite3_column_bytes(select, 0));
    sqlite3_finalize(select);
    return found;
  }

 private:
  using Row = std::function<std::int64_t(sqlite3_stmt*)>;
  static std::int64_t number(sqlite3_stmt* row, int column) { return sqlite3_column_int64(row, column); }
  static void add_bytes(Hash64& hash, sqlite3_stmt* row, int column) {
    const auto* bytes = static_cast<const std::byte*>(sqlite3_column_blob(row, column));
    hash.add_bytes({bytes, static_cast<std::size_t>(sqlite3_column_bytes(row, column))});
  }
  /// Writes the checksums anew, as docs/reference/model-file.md gives them.
  void seal() {
    const auto each = [&](const char* select, const std::string& update, const Row& checksum) {
      if (sqlite3_table_column_metadata(handle_, nullptr, update.substr(7, update.find(' ', 7) - 7).c_str(), nullptr,
                                        nullptr, nullptr, nullptr, nullptr, nullptr) != SQLITE_OK)
        return;  // not a table any more
      std::map<std::int64_t, std::int64_t> found;
      sqlite3_stmt* rows = nullptr;
      if (sqlite3_prepare_v2(handle_, select, -1, &rows, nullptr) != SQLITE_OK) return;
      while (sqlite3_step(rows) == SQLITE_ROW) found[number(rows, 0)] = checksum(rows);
      sqlite3_finalize(rows);
      for (const auto& [rowid, hash] : found)
        run(update + std::to_string(hash) + " WHERE rowid = " + std::to_string(rowid));
    };
    const auto stored = [](const Hash64& hash) { return std::bit_cast<std::int64_t>(hash.value()); };
    const auto named = [&](sqlite3_stmt* row, int numbers, bool data) {
      Hash64 hash;
      add_bytes(hash, row, 1);
      for (int k = 0; k < numbers; ++k) hash.add(static_cast<std::uint64_t>(number(row, 2 + k)));
      if (data)
        add_bytes(hash, row, 2 + numbers);
      else
        hash.add_bytes({});
      return stored(hash);
    };
    each("SELECT rowid, part, data FROM cage",
         "UPDATE cage SET hash = ", [&](auto* row) { return named(row, 0, true); });
    each("SELECT rowid, layer, stroke, intervals FROM layers",
         "UPDATE layers SET hash = ", [&](auto* row) { return named(row, 2, false); });
    each("SELECT rowid, layer, page, stroke, whole, tiles, data FROM pages",
         "UPDATE pages SET hash = ", [&](auto* row) { return named(row, 4, true); });
    each("SELECT rowid, label, number, tiles, row_count, details FROM strokes",
         "UPDATE strokes SET hash = ", [&](auto* row) { return named(row, 3, true); });
    each(
        "SELECT c.rowid, f.value, n.value, s.value, u.value, l.value, m.value, t.value, d.value, o.value, e.value FROM "
        "meta c, meta f, meta n, meta s, meta u, meta l, meta m, meta t, meta d, meta o, meta e WHERE c.key = "
        "'checksum' "
        "AND f.key = 'format' AND n.key = 'fibres' AND s.key = 'slabs' AND u.key = 'current' AND l.key = 'last' AND "
        "m.key = 'mode' AND t.key = 'unit' AND d.key = 'source_diagonal' AND o.key = 'source' AND e.key = "
        "'certificate'",
        "UPDATE meta SET value = ", [&](auto* row) {
          Hash64 hash;
          for (int k = 1; k <= 5; ++k) hash.add(static_cast<std::uint64_t>(number(row, k)));
          const std::string mode(reinterpret_cast<const char*>(sqlite3_column_text(row, 6)));
          const std::string unit(reinterpret_cast<const char*>(sqlite3_column_text(row, 7)));
          hash.add(mode == "certified" ? 0 : mode == "tolerant" ? 1 : 2);
          hash.add(unit == "mm" ? 0 : unit == "cm" ? 1 : 2);
          hash.add(std::bit_cast<std::uint64_t>(sqlite3_column_double(row, 8)));
          add_bytes(hash, row, 9);
          add_bytes(hash, row, 10);
          return stored(hash);
        });
  }

  sqlite3* handle_ = nullptr;
};

/// A small model with three strokes, one of which paints, and one stroke undone.
std::uint64_t make_small(const std::filesystem::path& file) {
  const Model model = ball(2, 4);
  auto made = ModelFile::create(file, model);
  EXPECT_OK(made);
  EXPECT_OK(made->commit(stroke(model.head, 1), {.label = "one"}));
  SnapshotDraft draft(made->model().head);
  draft.add_layer(Layer::Colour, 3, 1.0F);
  dab(draft, Layer::Colour, 7, 0.5F);
  EXPECT_OK(made->commit(draft.finish(), {.label = "paint"}));
  EXPECT_OK(made->commit(stroke(made->model().head, 3), {.label = "undone"}));
  EXPECT_OK(made->undo());
  return made->model().head->content_hash();
}

/// Opens, walks through the history and writes; nothing may go wrong but by a sentence in one line. True when it
/// opened.
bool survives(const std::filesystem::path& file, std::uint64_t hash) {
  const auto sentence = [&](const Error& error) {
    EXPECT_NE(error.message.find(file.filename().string()), std::string::npos) << error.message;
    EXPECT_EQ(error.message.find('\n'), std::string::npos) << error.message;
    EXPECT_LT(error.message.size(), 450U) << error.message;
  };
  auto opened = ModelFile::open(file);
  if (!opened) {
    sentence(opened.error());
    return false;
  }
  EXPECT_EQ(opened->model().head->content_hash(), hash);
  if (const auto records = opened->strokes(); !records) sentence(records.error());
  if (const auto moved = opened->redo(9); !moved) sentence(moved.error());
  if (const auto moved = opened->undo(9); !moved) sentence(moved.error());
  if (const auto done = opened->commit(stroke(opened->model().head, 9), {}); !done) sentence(done.error());
  return true;
}

TEST(DamagedFile, CutAnywhere) {
  const Folder folder;
  const std::uint64_t hash = make_small(folder / "a.relief");
  const std::string whole = read_file(folder / "a.relief");
  std::vector<std::size_t> lengths = {0, 1, 15, 16, 50, 99, 100, 101, 511, 512, 513, 1023, 4095, 4096, 4097};
  for (std::size_t k = 1; k < 40; ++k) lengths.push_back(whole.size() * k / 40);
  for (const std::size_t length : lengths) {
    write_file(folder / "cut.relief", whole.substr(0, length));
    EXPECT_FALSE(survives(folder / "cut.relief", hash)) << length;
    EXPECT_FALSE(ModelFile::open(folder / "cut.relief", true).has_value()) << length;
  }
  write_file(folder / "cut.relief", whole.substr(0, whole.size() - 1));  // a byte that may have held nothing
  (void)survives(folder / "cut.relief", hash);
  write_file(folder / "cut.relief", whole);
  EXPECT_TRUE(survives(folder / "cut.relief", hash));
}

TEST(DamagedFile, AnyByteAltered) {
  const Folder folder;
  Model model = ball(2, 12);
  model.head =
      testing::displaced(model.head->shared_slab_mesh(),  // values that fill all their bits
                         [](Vec3d p) { return 0.5 + 0.3 * std::sin(40 * p.x + 9 * p.y) * std::cos(30 * p.z); });
  const std::uint64_t hash = model.head->content_hash();
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", model).has_value());
  const std::string whole = read_file(folder / "a.relief");
  std::uint64_t random = 88172645463325252U;
  const auto next = [&] {
    random ^= random << 13U;
    random ^= random >> 7U;
    random ^= random << 17U;
    return random;
  };
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::string bytes = whole;
    // The first hundred rounds alter the header and the first pages, where structure lies.
    const std::size_t at = next() % (round < 50 ? 100 : round < 100 ? 4096 : bytes.size());
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U + next() % 255));
    write_file(folder / "b.relief", bytes);
    refused += survives(folder / "b.relief", hash) ? 0 : 1;
  }
  EXPECT_GT(refused, 100) << "the alterations should have met something that matters";
}

TEST(DamagedFile, Rubbish) {
  const Folder folder;
  const auto code = [&](const std::string& bytes) {
    write_file(folder / "a.relief", bytes);
    return ModelFile::open(folder / "a.relief").error().code;
  };
  EXPECT_EQ(code(""), Errc::UnsupportedFormat);
  EXPECT_EQ(code("ply\nformat ascii 1.0\n"), Errc::UnsupportedFormat);
  EXPECT_EQ(code(std::string(100000, '\0')), Errc::UnsupportedFormat);
  EXPECT_EQ(code(std::string("SQLite format 3\0", 16) + std::string(5000, '\xff')), Errc::UnsupportedFormat);
  EXPECT_EQ(ModelFile::open(folder / "none.relief").error().code, Errc::NotFound);
  EXPECT_EQ(ModelFile::open(folder / ".").error().code, Errc::Io);
  EXPECT_EQ(ModelFile::open("/dev/zero").error().code, Errc::Io);
  ASSERT_EQ(::mkfifo((folder / "pipe.relief").c_str(), 0600), 0);
  EXPECT_EQ(ModelFile::open(folder / "pipe.relief", true).error().code, Errc::Io);
}

TEST(DamagedFile, AnotherProgramsDatabaseIsLeftAlone) {
  const Folder folder;
  {
    sqlite3* handle = nullptr;
    ASSERT_EQ(sqlite3_open((folder / "a.db").c_str(), &handle), SQLITE_OK);
    sqlite3_exec(handle, "PRAGMA journal_mode = WAL; CREATE TABLE t(x); INSERT INTO t VALUES(1)", nullptr, nullptr,
                 nullptr);
    sqlite3_close(handle);
  }
  const std::string before = read_file(folder / "a.db");
  EXPECT_EQ(ModelFile::open(folder / "a.db").error().code, Errc::UnsupportedFormat);
  EXPECT_EQ(read_file(folder / "a.db"), before);
}

TEST(DamagedFile, AControlCharacterInTheNameIsEscaped) {
  const Folder folder;
  const auto missing = ModelFile::open(folder / "a\nb\x1b.relief");
  EXPECT_EQ(missing.error().message.find('\n'), std::string::npos);
  EXPECT_EQ(missing.error().message.find('\x1b'), std::string::npos);
}

TEST(ForgedFile, TheForgerKnowsTheFormat) {
  const Folder folder;
  const std::uint64_t hash = make_small(folder / "a.relief");
  {
    Forger forger(folder / "a.relief");
    forger.run("UPDATE meta SET value = value + 1 WHERE key = 'checksum'");
    forger.run("UPDATE pages SET hash = 0");
    forger.run("UPDATE cage SET hash = 0");
    forger.run("UPDATE layers SET hash = 0");
    forger.run("UPDATE strokes SET hash = 0");
  }
  EXPECT_TRUE(survives(folder / "a.relief", hash)) << "else the tests below would show nothing";
}

/// Opens a model that was forged by `sql`, and expects it to be refused with the given code and word.
void expect_refused(const std::string& sql, Errc code, const char* word) {
  const Folder folder;
  make_small(folder / "a.relief");
  {
    Forger(folder / "a.relief").run(sql);
  }
  const auto opened = ModelFile::open(folder / "a.relief");
  ASSERT_FALSE(opened.has_value()) << sql;
  EXPECT_EQ(opened.error().code, code) << sql << ": " << opened.error().message;
  EXPECT_NE(opened.error().message.find(word), std::string::npos) << sql << ": " << opened.error().message;
}

TEST(ForgedFile, IsRefusedWithAReason) {
  expect_refused("PRAGMA user_version = 5", Errc::NewerVersion, "newer");
  expect_refused("PRAGMA user_version = 0", Errc::Corrupt, "version");
  expect_refused("PRAGMA application_id = 7", Errc::UnsupportedFormat, "not a .relief");
  expect_refused("DROP TABLE strokes", Errc::Corrupt, "table");
  expect_refused("CREATE TABLE more(x)", Errc::Corrupt, "tables");
  expect_refused("CREATE TRIGGER t AFTER UPDATE ON meta BEGIN DELETE FROM pages; END", Errc::Corrupt, "tables");
  expect_refused("DROP TABLE cage; CREATE VIEW cage AS SELECT 'fibres' AS part, 0 AS hash, randomblob(1000000) AS data",
                 Errc::Corrupt, "tables");
  expect_refused("DELETE FROM meta WHERE key = 'slabs'", Errc::Corrupt, "slabs");
  expect_refused("UPDATE meta SET value = 'x' WHERE key = 'slabs'", Errc::Corrupt, "slabs");
  expect_refused("UPDATE meta SET value = 'perfect' WHERE key = 'mode'", Errc::Corrupt, "sense");
  expect_refused("UPDATE meta SET value = 9e999 WHERE key = 'source_diagonal'", Errc::Corrupt, "sense");
  expect_refused("UPDATE meta SET value = 99 WHERE key = 'current'", Errc::Corrupt, "sense");
  expect_refused("UPDATE meta SET value = 99 WHERE key = 'last'", Errc::Corrupt, "gap");
  expect_refused("UPDATE meta SET value = -1 WHERE key = 'current'", Errc::Corrupt, "sense");
  expect_refused("UPDATE meta SET value = 1000000000 WHERE key = 'slabs'", Errc::Corrupt, "number of slabs");
  expect_refused("UPDATE meta SET value = 9223372036854775807 WHERE key = 'slabs'", Errc::Corrupt, "sense");
  expect_refused("UPDATE meta SET value = 127 WHERE key = 'slabs'", Errc::Corrupt, "slabs");
  expect_refused("UPDATE meta SET value = 67 WHERE key = 'fibres'", Errc::Corrupt, "fibres");
  expect_refused("UPDATE cage SET data = zeroblob(100) WHERE part = 'slabs'", Errc::Corrupt, "slabs");
  expect_refused("DELETE FROM cage WHERE part = 'fibres'", Errc::Corrupt, "fibres");
  expect_refused("UPDATE layers SET layer = 'smell' WHERE layer = 'colour'", Errc::Corrupt, "layer");
  expect_refused("UPDATE layers SET intervals = 129 WHERE layer = 'colour'", Errc::Corrupt, "layers");
  expect_refused("UPDATE layers SET intervals = 128 WHERE layer = 'colour'", Errc::Corrupt, "page 0 of colour");
  expect_refused("UPDATE layers SET stroke = 1 WHERE layer = 'colour'", Errc::Corrupt, "stroke");
  expect_refused("DELETE FROM layers", Errc::Corrupt, "stroke");
  expect_refused("DELETE FROM pages WHERE stroke = 1", Errc::Corrupt, "stroke");
  expect_refused("DELETE FROM strokes WHERE number = 2", Errc::Corrupt, "gap");
  expect_refused("UPDATE pages SET page = page + 1 WHERE stroke = 0 AND page = 1", Errc::Corrupt, "page 1");
  expect_refused("UPDATE pages SET tiles = 1 WHERE stroke = 0", Errc::Corrupt, "page 0");
  expect_refused("UPDATE pages SET tiles = 0 WHERE stroke = 1", Errc::Corrupt, "displacement at stroke 1");
  expect_refused("UPDATE pages SET data = x'00' WHERE stroke = 1", Errc::Corrupt, "displacement at stroke 1");
  expect_refused("UPDATE pages SET whole = 1 WHERE stroke = 1", Errc::Corrupt, "displacement at stroke 1");
}

/// The sphere's shell on a lattice, on which the verifier judges, as convert makes it; one fibre may be turned round.
std::shared_ptr<const SlabMesh> shell_on_lattice(FibreId turned = kNoSlab) {
  const auto rough = testing::sphere_shell(2, 4);
  const auto on_lattice = [](Vec3d p) {
    const auto snap = [](double x) { return std::round(x * 1024) / 1024; };
    return Vec3d{snap(p.x), snap(p.y), snap(p.z)};
  };
  std::vector<Fibre> fibres;
  for (const Fibre& f : rough->fibres()) fibres.push_back({on_lattice(f.inner), on_lattice(f.outer)});
  if (turned != kNoSlab) std::swap(fibres[turned].inner, fibres[turned].outer);
  std::vector<SlabMesh::Face> faces;
  for (const Slab& s : rough->slabs()) faces.push_back({s.fibres, s.intervals});
  auto made = SlabMesh::make(std::move(fibres), faces);
  EXPECT_TRUE(made);
  return std::make_shared<const SlabMesh>(std::move(*made));
}

TEST(ForgedFile, ACageThatIsNotWhatTheFileSaysIsOpenedWithADoubt) {
  const Folder folder;
  const std::filesystem::path file = folder / "a.relief";
  ASSERT_TRUE(ModelFile::create(file, ball(shell_on_lattice())));
  ASSERT_TRUE(ModelFile::create(folder / "b.relief", ball(shell_on_lattice(3))));
  {
    RELIEF_MUST(sound, ModelFile::open(file, true));
    EXPECT_EQ(sound.doubt(), "");
  }
  {
    Forger other(folder / "b.relief"), forger(file);
    forger.put("cage", "part = 'fibres'", other.blob("SELECT data FROM cage WHERE part = 'fibres'"));
  }
  RELIEF_MUST(model, ModelFile::open(file));
  EXPECT_NE(model.doubt().find("do not hold C1"), std::string::npos) << model.doubt();
  EXPECT_NE(model.doubt().find("is folded at"), std::string::npos) << model.doubt();
  const std::atomic<bool> stop = true;
  EXPECT_NE(model.doubt({.report = {}, .cancel = &stop}).find("could not be tested"), std::string::npos);
  // Nothing that was saved is kept from its owner.
  EXPECT_OK(model.commit(stroke(model.model().head, 1), {}));
  // Preview claims less, but what the file says was proven must hold, too.
  Model preview = ball(shell_on_lattice());
  preview.info.mode = Mode::Preview;
  ASSERT_TRUE(ModelFile::create(folder / "p.relief", preview));
  {
    Forger other(folder / "b.relief"), forger(folder / "p.relief");
    forger.put("cage", "part = 'fibres'", other.blob("SELECT data FROM cage WHERE part = 'fibres'"));
  }
  RELIEF_MUST(doubtful, ModelFile::open(folder / "p.relief"));
  EXPECT_NE(doubtful.doubt(), "");
  // A preview of which nothing was proven, for its numbers lie on no lattice, says nothing that could fail.
  preview = ball();
  preview.info.mode = Mode::Preview;
  ASSERT_TRUE(ModelFile::create(folder / "q.relief", preview));
  RELIEF_MUST(plain, ModelFile::open(folder / "q.relief"));
  EXPECT_EQ(plain.doubt(), "");
}

TEST(ForgedFile, NumbersInsideBlobsAreChecked) {
  const Folder folder;
  const int n = 4;
  const std::size_t tile = sample_count(n);
  const auto tampered = [&](const std::string& table, const std::string& where, std::size_t width, std::size_t bytes,
                            const std::function<void(std::byte*)>& change) {
    make_small(folder / "a.relief");
    {
      Forger forger(folder / "a.relief");
      std::vector<std::byte> raw(bytes);
      EXPECT_TRUE(detail::unpack(forger.blob("SELECT data FROM " + table + " WHERE " + where), width, raw));
      change(raw.data());
      forger.put(table, where, detail::pack(raw, width));
    }
    const auto opened = ModelFile::open(folder / "a.relief");
    EXPECT_FALSE(opened.has_value());
    if (opened) return std::string();
    EXPECT_EQ(opened.error().code, Errc::Corrupt);
    return opened.error().message;
  };
  const auto sample = [&](std::size_t at, float value) {
    return tampered("pages", "layer = 'displacement' AND page = 1 AND stroke = 0", 4, 64 * tile * 4,
                    [&](std::byte* raw) { std::memcpy(raw + at * 4, &value, 4); });
  };
  EXPECT_NE(sample(tile * 5 + 7, std::nanf("")).find("slab 69"), std::string::npos);
  EXPECT_NE(sample(tile * 6 + 7, 1.0001F).find("slab 70"), std::string::npos);
  EXPECT_NE(sample(tile * 7, 0.125F).find("shared"), std::string::npos);

  const auto slab = [&](std::size_t at, std::uint32_t value) {
    return tampered("cage", "part = 'slabs'", 4, 128 * 16,
                    [&](std::byte* raw) { std::memcpy(raw + at * 4, &value, 4); });
  };
  EXPECT_NE(slab(4 * 9 + 1, 66).find("slab 9"), std::string::npos) << "no such fibre";
  EXPECT_NE(slab(4 * 9 + 3, 0).find("slab 9"), std::string::npos);
  EXPECT_NE(slab(4 * 9 + 3, 0x80000000U).find("slab 9"), std::string::npos);
  EXPECT_NE(slab(4 * 9 + 3, 5).find("power of two"), std::string::npos) << "not the n of its neighbours";
  EXPECT_NE(slab(4 * 9 + 3, 128).find("page 0 of displacement"), std::string::npos) << "a tile is smaller";

  const auto fibre = [&](double value) {
    return tampered("cage", "part = 'fibres'", 8, 66 * 48,
                    [&](std::byte* raw) { std::memcpy(raw + 48 * 13 + 8, &value, 8); });
  };
  EXPECT_NE(fibre(std::numeric_limits<double>::infinity()).find("fibre 13"), std::string::npos);
  EXPECT_NE(fibre(std::nan("")).find("fibre 13"), std::string::npos);
}

/// A file of format 2 with a layer of colour, floats there, in which `change` changed the value of every sample.
void make_format_2(const std::filesystem::path& file, const std::function<float(std::size_t, float)>& change) {
  std::filesystem::copy_file(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data/format-2.relief", file,
                             std::filesystem::copy_options::overwrite_existing);
  Forger forger(file);
  std::vector<std::byte> raw(32 * 3 * sample_count(3) * sizeof(float));
  ASSERT_TRUE(detail::unpack(forger.blob("SELECT data FROM pages WHERE layer = 'colour'"), sizeof(float), raw));
  for (std::size_t k = 0; k < raw.size() / sizeof(float); ++k) {
    float value = 0;
    std::memcpy(&value, raw.data() + k * sizeof value, sizeof value);
    value = change(k, value);
    std::memcpy(raw.data() + k * sizeof value, &value, sizeof value);
  }
  forger.put("pages", "layer = 'colour'", detail::pack(raw, sizeof(float)));
}

TEST(ForgedFile, ColoursOfFormat2AreCheckedBeforeTheyAreRounded) {
  const Folder folder;
  for (const float bad : {std::nanf(""), 1.0001F, -0.0001F}) {
    make_format_2(folder / "a.relief", [&](std::size_t k, float value) { return k == 5 ? bad : value; });
    const auto opened = ModelFile::open(folder / "a.relief");
    ASSERT_FALSE(opened.has_value()) << bad;
    EXPECT_EQ(opened.error().code, Errc::Corrupt);
    EXPECT_NE(opened.error().message.find("page 0 of colour"), std::string::npos) << opened.error().message;
    EXPECT_NE(opened.error().message.find("outside its range"), std::string::npos) << opened.error().message;
  }
}

TEST(ForgedFile, ColoursOfFormat2TakeStrokes) {
  const Folder folder;
  // What rounding to 16 bits takes across a power of two, where the bits of floats change most.
  make_format_2(folder / "a.relief", [](std::size_t, float value) { return value == 0.25F ? 0.249999F : value; });
  std::vector<std::uint64_t> hashes;
  {
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
    for (const SlabId s : {7, 8, 7}) {
      SnapshotDraft draft(file.model().head);
      dab(draft, Layer::Colour, s, 0.3F * static_cast<float>(hashes.size() + 1));
      hashes.push_back(file.model().head->content_hash());
      EXPECT_OK(file.commit(draft.finish(), {.label = "paint"}));
    }
    hashes.push_back(file.model().head->content_hash());
  }
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  for (std::size_t k = hashes.size(); k-- > 0;) {
    EXPECT_EQ(file.model().head->content_hash(), hashes[k]) << k;
    EXPECT_OK(file.undo());
  }
}

TEST(ForgedFile, ConstrainedSamplesAreCheckedToTheLastBit) {
  const Folder folder;
  const Model model = ball(testing::mixed_shell(*testing::sphere_shell(1, 1), 3, 3));
  const SlabMesh& mesh = model.head->slab_mesh();
  std::size_t begin = 0, tried = 0;
  std::size_t bytes = 0;
  for (const Slab& slab : mesh.slabs()) bytes += sample_count(slab.intervals) * sizeof(float);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    std::optional<GridPoint> bound;
    mesh.for_each_constrained(s, [&](GridPoint p, const EdgePlace&) { bound = p; });
    if (bound && tried < 3) {
      ++tried;
      ASSERT_TRUE(ModelFile::create(folder / "a.relief", model).has_value());
      {
        Forger forger(folder / "a.relief");
        std::vector<std::byte> raw(bytes);
        ASSERT_TRUE(detail::unpack(forger.blob("SELECT data FROM pages"), 4, raw));
        raw[(begin + sample_index(mesh.intervals(s), *bound)) * sizeof(float)] ^= std::byte{1};
        forger.put("pages", "page = 0", detail::pack(raw, 4));
      }
      const auto opened = ModelFile::open(folder / "a.relief");
      ASSERT_FALSE(opened.has_value());
      EXPECT_EQ(opened.error().code, Errc::Corrupt);
      EXPECT_NE(opened.error().message.find("does not follow"), std::string::npos) << opened.error().message;
      EXPECT_NE(opened.error().message.find("slab " + std::to_string(s) + " "), std::string::npos);
    }
    begin += sample_count(mesh.intervals(s));
  }
  EXPECT_EQ(tried, 3U);
}

TEST(ForgedFile, AWalFileIsBroughtBackToOneFile) {
  const Folder folder;
  const std::uint64_t hash = make_small(folder / "a.relief");
  {
    Forger(folder / "a.relief").run("PRAGMA journal_mode = WAL");
  }
  EXPECT_TRUE(survives(folder / "a.relief", hash));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
}

TEST(TileCodec, BlobsAreExactAndNeverExpandMuch) {
  for (const std::size_t count : {1U, 2U, 1000U, 400000U}) {
    for (const bool plain : {true, false}) {
      std::vector<float> values(count);
      for (std::size_t k = 0; k < count; ++k) values[k] = plain ? 0.5F : static_cast<float>(k % 977) / 977;
      const auto raw = std::as_bytes(std::span(values));
      const std::vector<std::byte> blob = detail::pack(raw, 4);
      EXPECT_GE(blob.size() * detail::kMaxExpansion + detail::kMaxExpansion, raw.size());
      std::vector<std::byte> back(raw.size());
      ASSERT_TRUE(detail::unpack(blob, 4, back));
      EXPECT_EQ(std::memcmp(back.data(), raw.data(), raw.size()), 0);
      std::vector<std::byte> more(raw.size() + 4), less(raw.size() - 4);
      EXPECT_FALSE(detail::unpack(blob, 4, more));
      EXPECT_FALSE(detail::unpack(blob, 4, less));
      for (std::size_t cut = 0; cut < blob.size(); cut += 1 + blob.size() / 7)
        EXPECT_FALSE(detail::unpack(std::span(blob).first(cut), 4, back) && cut < blob.size() / 2);
    }
  }
  std::vector<std::byte> nothing(4);
  EXPECT_FALSE(detail::unpack({}, 4, nothing));
}

}  // namespace
}  // namespace relief
