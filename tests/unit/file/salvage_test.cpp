// Damage in a model's history: what opens is the true state of the stroke that it claims, and what is whole is saved.
#include <relief/file/tile_codec.h>

#include <sqlite3.h>
#include <unit/file/file_support.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <random>

namespace relief {
namespace {

using testing::ball;
using testing::dab;
using testing::Folder;
using testing::read_file;
using testing::stroke;
using testing::write_file;

/// A model and what each of its states is, undone ones included.
struct Known {
  std::vector<std::uint64_t> hashes;  ///< by stroke
  std::uint64_t current = 0;
};

/// `strokes` strokes, the last two of them undone; colour comes at a third of them and goes at three quarters. Others
/// that were undone before have left their room in the file.
Known make_history(const std::filesystem::path& path, const Model& model, std::uint64_t strokes) {
  Known known{.hashes = {model.head->content_hash()}};
  auto file = ModelFile::create(path, model);
  EXPECT_OK(file);
  const auto commit = [&](SnapshotPtr head) {
    known.hashes.push_back(head->content_hash());
    EXPECT_OK(file->commit(std::move(head), {.label = "stroke " + std::to_string(known.hashes.size() - 1)}));
  };
  for (std::uint64_t k = 1; k <= strokes; ++k) {
    const SnapshotPtr head = file->model().head;
    SnapshotDraft draft(head);
    if (k == strokes / 3) draft.add_layer(Layer::Colour, 3, 1.0F);
    if (k >= strokes / 3 && k % 3 == 0 && k < strokes * 3 / 4)
      dab(draft, Layer::Colour, static_cast<SlabId>(k % head->slab_mesh().slab_count()), 0.5F);
    dab(draft, Layer::Displacement, static_cast<SlabId>(k * 37 % head->slab_mesh().slab_count()),
        static_cast<float>(k % 97) / 97);
    SnapshotPtr next = draft.finish();
    if (k == strokes * 3 / 4) {
      SnapshotDraft without(Snapshot::make(next->shared_slab_mesh()));
      for (SlabId s = 0; s < next->slab_mesh().slab_count(); ++s) {
        Tile& tile = without.edit(Layer::Displacement, s);
        std::copy_n(next->displacement(s), tile.stride(), tile.plane());
      }
      next = without.finish();
    }
    commit(std::move(next));
    if (k == strokes / 2) {
      for (std::uint64_t other = 0; other < 3; ++other) {
        EXPECT_OK(file->commit(stroke(file->model().head, 1000 + other), {.label = "never was"}));
      }
      EXPECT_OK(file->undo(3));
    }
  }
  EXPECT_OK(file->undo(2));
  known.current = strokes - 2;
  return known;
}

bool is_damaged(const std::vector<DamagedStrokes>& damage, std::uint64_t stroke) {
  return std::ranges::any_of(damage, [&](const DamagedStrokes& d) { return d.first <= stroke && stroke <= d.last; });
}

/// Every state that can be read must be the true one of its stroke, and all that are not said to be damaged can be
/// read.
void expect_true_states(const ModelFile& file, const Known& known, std::uint64_t first,
                        const std::vector<DamagedStrokes>& damage) {
  SnapshotPtr near = file.model().head;
  std::uint64_t near_stroke = file.stroke_count();
  for (std::uint64_t k = 0; k <= file.stroke_count() + file.redo_count(); ++k) {
    const auto state = file.at(k, near, near_stroke);
    if (!state) {
      EXPECT_TRUE(is_damaged(damage, k)) << k << ": " << state.error().message;
      continue;
    }
    ASSERT_LT(first + k, known.hashes.size());
    ASSERT_EQ((*state)->content_hash(), known.hashes[first + k]) << "the state of stroke " << k << " is another";
    near = *state;
    near_stroke = k;
  }
}

/// What became of a damaged file.
enum class Fate : std::uint8_t { Opened, Salvaged, Lost };

Fate judge(const Folder& folder, const std::filesystem::path& path, const Known& known) {
  const auto out = folder / "out.relief";
  {
    const auto opened = ModelFile::open(path);
    if (opened) {
      EXPECT_EQ(opened->stroke_count(), known.current);
      EXPECT_EQ(opened->model().head->content_hash(), known.hashes[known.current]);
      const auto damage = opened->damage();
      EXPECT_OK(damage);
      EXPECT_FALSE(is_damaged(*damage, known.current));
      expect_true_states(*opened, known, 0, *damage);
      return Fate::Opened;
    }
    EXPECT_EQ(opened.error().message.contains("--salvage"), opened.error().code == Errc::Corrupt);
  }
  const auto saved = ModelFile::salvage(path, out);
  if (!saved) {
    EXPECT_FALSE(std::filesystem::exists(out));
    EXPECT_EQ(saved.error().message.find('\n'), std::string::npos);
    EXPECT_LT(saved.error().message.size(), 450U) << saved.error().message;
    return Fate::Lost;
  }
  const auto opened = ModelFile::open(out);
  EXPECT_OK(opened);
  if (!opened) return Fate::Lost;
  EXPECT_EQ(saved->first + opened->stroke_count(), saved->current);
  EXPECT_EQ(saved->current + opened->redo_count(), saved->last);
  EXPECT_EQ(opened->model().head->content_hash(), known.hashes[saved->current]);
  const auto damage = opened->damage();
  EXPECT_OK(damage);
  EXPECT_TRUE(damage->empty());
  expect_true_states(*opened, known, saved->first, {});
  std::filesystem::remove(out);
  return Fate::Salvaged;
}

/// The keys of a row of the table pages.
struct PageRow {
  std::int64_t rowid, page, stroke, whole;
  std::string layer;
};

class Sql {
 public:
  explicit Sql(const std::filesystem::path& file) { EXPECT_EQ(sqlite3_open(file.c_str(), &handle_), SQLITE_OK); }
  Sql(const Sql&) = delete;
  Sql& operator=(const Sql&) = delete;
  ~Sql() { sqlite3_close(handle_); }
  void run(const std::string& sql) {
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
  }
  [[nodiscard]] std::vector<PageRow> pages() {
    std::vector<PageRow> found;
    sqlite3_stmt* rows = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(handle_, "SELECT rowid, page, stroke, whole, layer FROM pages", -1, &rows, nullptr),
              SQLITE_OK);
    while (sqlite3_step(rows) == SQLITE_ROW)
      found.push_back({sqlite3_column_int64(rows, 0), sqlite3_column_int64(rows, 1), sqlite3_column_int64(rows, 2),
                       sqlite3_column_int64(rows, 3), reinterpret_cast<const char*>(sqlite3_column_text(rows, 4))});
    sqlite3_finalize(rows);
    return found;
  }

 private:
  sqlite3* handle_ = nullptr;
};

std::vector<DamagedStrokes> ranges(const std::vector<bool>& damaged) {
  std::vector<DamagedStrokes> found;
  for (std::uint64_t k = 0; k < damaged.size(); ++k) {
    if (!damaged[k]) continue;
    if (found.empty() || found.back().last + 1 != k) found.push_back({k, k});
    found.back().last = k;
  }
  return found;
}

constexpr std::uint64_t kMany = 150;  // more than twice as many as lie between two whole rows of a page

TEST(DamagedHistory, ARowTakesTheStatesThatNeedItAndNoOthers) {
  const Folder folder;
  const Known known = make_history(folder / "a.relief", ball(1, 3), kMany);
  const std::string whole = read_file(folder / "a.relief");
  const std::vector<PageRow> rows = Sql(folder / "a.relief").pages();
  ASSERT_GT(rows.size(), kMany);
  std::size_t opened_count = 0, refused_count = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const PageRow& row = rows[k];
    const auto path = folder / "b.relief";
    write_file(path, whole);
    const std::string where = " WHERE rowid = " + std::to_string(row.rowid);
    const std::array<std::string, 4> damages = {"data = CAST(data || x'00' AS BLOB)", "hash = hash + 1",
                                                "tiles = tiles - 1", "whole = 1 - whole"};
    Sql(path).run("UPDATE pages SET " + damages[k % damages.size()] + where);

    // A state needs the row unless the page was made anew since, or its layer has gone.
    std::vector<bool> needs(kMany + 1);
    const std::uint64_t gone = row.layer == "colour" ? kMany * 3 / 4 : kMany + 1;
    for (auto state = static_cast<std::uint64_t>(row.stroke); state <= kMany && state < gone; ++state) {
      if (std::ranges::any_of(rows, [&](const PageRow& other) {
            return other.layer == row.layer && other.page == row.page && other.whole == 1 &&
                   other.stroke > row.stroke && other.stroke <= static_cast<std::int64_t>(state);
          }))
        break;
      needs[state] = true;
    }
    const auto file = ModelFile::open(path);
    ASSERT_EQ(file.has_value(), !needs[known.current]) << row.stroke << (file ? "" : file.error().message);
    if (!file) {
      EXPECT_NE(file.error().message.find("--salvage"), std::string::npos) << file.error().message;
      ++refused_count;
      if (k % 10 == 0) {
        EXPECT_EQ(judge(folder, path, known), Fate::Salvaged) << row.stroke;
      }
      continue;
    }
    ++opened_count;
    RELIEF_MUST(damage, file->damage());
    EXPECT_EQ(damage, ranges(needs)) << row.layer << " at stroke " << row.stroke;
    if (k % 10 == 0) expect_true_states(*file, known, 0, damage);
  }
  EXPECT_GT(opened_count, 60U);
  EXPECT_GT(refused_count, 10U);
}

TEST(DamagedHistory, UndoStopsBeforeItAndSaysSo) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Known known = make_history(path, ball(1, 3), kMany);
  std::int64_t anew = 0;
  for (const PageRow& row : Sql(path).pages())
    if (row.whole == 1 && row.stroke <= static_cast<std::int64_t>(known.current)) anew = std::max(anew, row.stroke);
  ASSERT_GT(anew, 100);
  Sql(path).run("UPDATE pages SET data = x'00' WHERE layer = 'displacement' AND stroke BETWEEN 40 AND 64");
  Sql(path).run("UPDATE strokes SET label = 'other' WHERE number = 7");
  RELIEF_MUST(file, ModelFile::open(path));
  RELIEF_MUST(damage, file.damage());
  ASSERT_EQ(damage.size(), 1U);
  EXPECT_EQ(damage[0].first, 40U);
  EXPECT_EQ(to_string(damage[0]), "strokes 40 to " + std::to_string(damage[0].last) + " are damaged");
  const std::uint64_t stop = damage[0].last + 1;
  const auto too_far = file.undo(known.current - 50);
  ASSERT_FALSE(too_far.has_value());
  EXPECT_EQ(too_far.error().code, Errc::Corrupt);
  EXPECT_NE(too_far.error().message.find(to_string(damage[0]) + ", and undo stops at stroke " + std::to_string(stop)),
            std::string::npos)
      << too_far.error().message;
  EXPECT_EQ(file.stroke_count(), known.current) << "nothing has moved";
  EXPECT_OK(file.undo(known.current - stop));
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[stop]);
  EXPECT_FALSE(file.undo().has_value());
  EXPECT_EQ(file.stroke_count(), stop);
  RELIEF_MUST(beyond, file.undo(stop - 20));
  EXPECT_EQ(beyond, stop - 20) << "past them the states are whole again";
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[20]);
  const auto forth = file.redo(30);
  ASSERT_FALSE(forth.has_value());
  EXPECT_NE(forth.error().message.find("redo stops at stroke 39"), std::string::npos) << forth.error().message;
  RELIEF_MUST(records, file.strokes());
  EXPECT_TRUE(records[6].damaged);
  EXPECT_EQ(records[6].label, "");
  EXPECT_FALSE(records[5].damaged);
  EXPECT_EQ(records[5].label, "stroke 6");
}

TEST(DamagedHistory, UndoneStrokesThatLackRowsAreNotRedone) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Known known = make_history(path, ball(1, 3), 12);
  Sql(path).run("DELETE FROM pages WHERE stroke = 12 AND layer = 'displacement'");
  RELIEF_MUST(file, ModelFile::open(path));
  RELIEF_MUST(damage, file.damage());
  EXPECT_EQ(damage, (std::vector<DamagedStrokes>{{12, 12}}));
  EXPECT_EQ(file.at(12).error().code, Errc::Corrupt);
  EXPECT_EQ(file.go_to(12, file.model().head).error().code, Errc::Corrupt);
  EXPECT_EQ(file.redo(2).error().code, Errc::Corrupt);
  EXPECT_OK(file.redo(1));
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[11]);
  const SnapshotPtr next = stroke(file.model().head, 99);
  EXPECT_OK(file.commit(next, {}));
  EXPECT_OK(file.undo());
  EXPECT_OK(file.redo());
  EXPECT_EQ(file.model().head->content_hash(), next->content_hash()) << "what lacked rows was dropped";
}

TEST(DamagedHistory, FromAStateAtHandTheOneBesideItIsReadByTheDifferenceAlone) {
  const Folder folder;
  const auto path = folder / "a.relief";
  std::vector<SnapshotPtr> states = {ball(1, 1).head};
  {
    RELIEF_MUST(file, ModelFile::create(path, ball(1, 1)));
    for (std::uint64_t k = 1; k <= 80; ++k) {
      states.push_back(stroke(states.back(), k));
      ASSERT_TRUE(file.commit(states.back(), {}).has_value());
    }
  }
  Sql(path).run("UPDATE pages SET data = x'00' WHERE stroke = 0");
  RELIEF_MUST(file, ModelFile::open(path, true));
  RELIEF_MUST(damage, file.damage());
  EXPECT_EQ(damage, (std::vector<DamagedStrokes>{{0, 64}}));
  RELIEF_MUST(back, file.at(10, states[11], 11));
  EXPECT_EQ(back->content_hash(), states[10]->content_hash());
  RELIEF_MUST(forth, file.at(14, states[11], 11));
  EXPECT_EQ(forth->content_hash(), states[14]->content_hash());
  EXPECT_EQ(file.at(10, states[80], 80).error().code, Errc::Corrupt) << "a page written whole lies between";
}

TEST(DamagedHistory, WhatIsWholeAndFollowsIsSalvaged) {
  const Folder folder;
  const auto path = folder / "a.relief", out = folder / "out.relief";
  const Known known = make_history(path, ball(1, 3), kMany);
  Sql(path).run("UPDATE pages SET data = x'00' WHERE layer = 'displacement' AND stroke IN (50, 140)");
  EXPECT_FALSE(ModelFile::open(path).has_value());
  EXPECT_EQ(ModelFile::salvage(path, path).error().code, Errc::InvalidArgument);
  const std::atomic<bool> stop = true;
  EXPECT_EQ(ModelFile::salvage(path, out, {.report = {}, .cancel = &stop}).error().code, Errc::Cancelled);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
  RELIEF_MUST(saved, ModelFile::salvage(path, out));
  EXPECT_EQ(saved.current, 139U);
  EXPECT_EQ(saved.last, 139U);
  EXPECT_GT(saved.first, 50U);
  EXPECT_LT(saved.first, 70U);
  const std::string before = std::to_string(saved.first - 1);
  EXPECT_EQ(saved.lost,
            (std::vector<std::string>{"strokes 50 to " + before + " (damaged)", "strokes 140 to 150 (damaged)",
                                      "all up to stroke 49 (cut off by that)"}));
  RELIEF_MUST(file, ModelFile::open(out));
  EXPECT_EQ(file.stroke_count(), 139 - saved.first);
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[139]);
  EXPECT_EQ(file.model().info.source, "ball \"1\".ply");
  RELIEF_MUST(records, file.strokes());
  EXPECT_EQ(records.front().label, "stroke " + std::to_string(saved.first + 1));
  EXPECT_OK(file.undo(1000));
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[saved.first]);
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.relief", "out.relief"}));
}

TEST(DamagedHistory, FilesOfOlderFormatsAreSalvagedAsTheyOpen) {
  const Folder folder;
  for (const char* golden : {"format-1.relief", "format-2.relief"}) {
    const auto path = folder / golden, out = folder / "out.relief";
    std::filesystem::copy_file(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data" / golden, path);
    RELIEF_MUST(saved, ModelFile::salvage(path, out));
    EXPECT_TRUE(saved.lost.empty());
    RELIEF_MUST(before, ModelFile::open(path, true));
    RELIEF_MUST(after, ModelFile::open(out, true));
    EXPECT_EQ(after.stroke_count(), before.stroke_count());
    EXPECT_EQ(after.redo_count(), before.redo_count());
    for (std::uint64_t k = 0; k <= before.stroke_count() + before.redo_count(); ++k) {
      RELIEF_MUST(old_state, before.at(k));
      RELIEF_MUST(new_state, after.at(k));
      EXPECT_EQ(new_state->content_hash(), old_state->content_hash()) << golden << " at " << k;
    }
    std::filesystem::remove(out);
  }
}

TEST(DamagedHistory, FactsThatFailClaimLeast) {
  const Folder folder;
  const auto path = folder / "a.relief", out = folder / "out.relief";
  const Known known = make_history(path, ball(1, 3), 9);
  Sql(path).run("UPDATE meta SET value = 'certifiez' WHERE key = 'mode'");
  Sql(path).run("DELETE FROM meta WHERE key = 'current'");
  RELIEF_MUST(saved, ModelFile::salvage(path, out));
  EXPECT_EQ(saved.current, 9U) << "the newest, for it is not known that it was undone";
  ASSERT_EQ(saved.lost.size(), 1U);
  RELIEF_MUST(file, ModelFile::open(out));
  EXPECT_EQ(file.model().info.mode, Mode::Preview);
  EXPECT_EQ(file.model().info.unit, Unit::Centimetre);
  EXPECT_EQ(file.model().head->content_hash(), known.hashes[9]);
  // The format alone, which stands in two places.
  make_history(path, ball(1, 3), 9);
  Sql(path).run("PRAGMA user_version = 1");
  EXPECT_FALSE(ModelFile::open(path).has_value());
  const auto other = folder / "other.relief";
  RELIEF_MUST(certain, ModelFile::salvage(path, other));
  EXPECT_EQ(certain.current, 7U);
  EXPECT_TRUE(certain.lost.empty());
  Sql(path).run("DELETE FROM cage WHERE part = 'slabs'");
  const auto nothing = ModelFile::salvage(path, folder / "none.relief");
  ASSERT_FALSE(nothing.has_value());
  EXPECT_NE(nothing.error().message.find("cage"), std::string::npos) << nothing.error().message;
  EXPECT_FALSE(std::filesystem::exists(folder / "none.relief"));
}

TEST(DamagedHistory, TheFirstPageIsTheSameInEveryModel) {
  const Folder folder;
  const auto path = folder / "a.relief", out = folder / "out.relief";
  const Known known = make_history(path, ball(1, 3), 9);
  const std::string whole = read_file(path);
  for (const std::size_t at : {3U, 17U, 30U, 45U, 63U, 70U, 101U, 104U, 3000U, 4000U}) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] + 1);
    write_file(path, bytes);
    if (ModelFile::open(path)) continue;  // a count that SQLite does without, or room that is not used
    const auto saved = ModelFile::salvage(path, out);
    ASSERT_TRUE(saved.has_value()) << at << ": " << saved.error().message;
    EXPECT_EQ(saved->current, known.current) << at;
    EXPECT_EQ(testing::saved_hash(out), known.hashes[known.current]) << at;
  }
  std::string bytes = whole;
  std::fill_n(bytes.begin() + 16, 4096 - 16, '\0');
  write_file(path, bytes);
  EXPECT_OK(ModelFile::salvage(path, out));
  write_file(path, std::string(100000, 'x'));
  EXPECT_EQ(ModelFile::salvage(path, out).error().code, Errc::UnsupportedFormat);
  write_file(path, "");
  EXPECT_EQ(ModelFile::salvage(path, out).error().code, Errc::UnsupportedFormat);
  EXPECT_EQ(ModelFile::salvage(folder / "none.relief", out).error().code, Errc::NotFound);
}

/// A few bits anywhere, and pages of the database that are gone or are those of another moment.
TEST(DamagedHistory, WhateverIsHitNoStateIsEverWrong) {
  const bool soak = std::getenv("RELIEF_SOAK") != nullptr;
  const Folder folder;
  const Known known = make_history(folder / "a.relief", ball(2, 4), 12);
  const std::string whole = read_file(folder / "a.relief");
  constexpr std::size_t kPage = 4096;
  std::mt19937 random(2711);
  const auto below = [&](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  std::array<int, 3> fates{};
  for (int round = 0; round < (soak ? 20000 : 400); ++round) {
    std::string bytes = whole;
    const std::size_t flips = round % 8 < 6 ? 1 : 1 + below(4);
    for (std::size_t k = 0; k < flips; ++k) {
      const std::size_t at = below(bytes.size());
      bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << below(8)));
    }
    if (round % 8 == 6)
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() / kPage) * kPage), kPage, '\0');
    if (round % 40 == 7) bytes.resize(below(bytes.size()));
    const auto path = folder / "b.relief";
    write_file(path, bytes);
    ++fates[static_cast<std::size_t>(judge(folder, path, known))];
    ASSERT_FALSE(HasFailure()) << "round " << round;
  }
  RecordProperty("opened", fates[0]);
  RecordProperty("salvaged", fates[1]);
  RecordProperty("lost", fates[2]);
  // The cage, and what the first state holds where no stroke has come since, stand in the file once.
  EXPECT_GT(2 * fates[1], fates[2]);
  EXPECT_GT(fates[0], fates[1]);
}

}  // namespace
}  // namespace relief
