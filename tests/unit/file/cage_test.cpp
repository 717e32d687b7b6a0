// Strokes that change the cage: every state comes back to the bit, and what is damaged is told.
#include <relief/base/hash.h>
#include <relief/core/detail.h>
#include <relief/file/tile_codec.h>

#include <sqlite3.h>
#include <support/fibre_maps.h>
#include <support/halved_roots.h>
#include <unit/file/file_support.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <span>

namespace relief {
namespace {

using testing::ball;
using testing::dab;
using testing::Folder;
using testing::stroke;
using testing::with_cut;

/// The root fibres of a model moved, its tiles as they are.
SnapshotPtr with_moved_fibre(const SnapshotPtr& model, FibreId moved, double outwards) {
  const SlabMesh& mesh = model->slab_mesh();
  std::vector<Fibre> fibres(mesh.root_fibres().begin(), mesh.root_fibres().end());
  fibres[moved].outer = fibres[moved].outer + fibres[moved].direction() * outwards;
  std::vector<SlabMesh::Face> faces;
  for (const Slab& root : mesh.roots()) faces.push_back({root.fibres, root.intervals});
  SlabMesh made = SlabMesh::make(std::move(fibres), faces).value().cut(mesh.cuts()).value();
  std::vector<int> intervals;
  for (const Slab& slab : mesh.slabs()) intervals.push_back(slab.intervals);
  const auto cage = std::make_shared<const SlabMesh>(made.refined(intervals).value());
  return Snapshot::with_cage(*model, cage, [&](Layer layer) {
    std::vector<TilePtr> tiles;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) tiles.push_back(model->shared_tile(layer, s));
    return tiles;
  });
}

SnapshotPtr with_grid(const SnapshotPtr& model, Layer layer, SlabId slab, int times) {
  return with_detail(model, {.cuts = {}, .grids = {{layer, slab, times * model->intervals(layer, slab)}}}).value();
}

SnapshotPtr with_colour(const SnapshotPtr& model, int m) {
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Colour, m, 1.0F);
  return draft.finish();
}

SnapshotPtr painted(const SnapshotPtr& model, SlabId slab, float value) {
  SnapshotDraft draft(model);
  dab(draft, Layer::Colour, slab, value);
  return draft.finish();
}

SnapshotPtr without(const SnapshotPtr& model, Layer gone) {
  return Snapshot::of_tiles(model->shared_slab_mesh(), [&](Layer layer) {
    std::vector<TilePtr> tiles;
    for (SlabId s = 0; layer != gone && model->has(layer) && s < model->slab_mesh().slab_count(); ++s)
      tiles.push_back(model->shared_tile(layer, s));
    return tiles;
  });
}

/// A file and all its states in memory.
struct Session {
  std::filesystem::path path;
  std::vector<SnapshotPtr> states;
  std::optional<ModelFile> file;

  Session(std::filesystem::path where, const Model& model) : path(std::move(where)), states{model.head} {
    auto made = ModelFile::create(path, model);
    EXPECT_OK(made);
    file.emplace(*std::move(made));
  }
  [[nodiscard]] const SnapshotPtr& head() const { return states.back(); }
  void commit(SnapshotPtr next) {
    EXPECT_OK(validate(*next));
    states.push_back(next);
    EXPECT_OK(file->commit(std::move(next), {.label = std::to_string(states.size() - 1)}));
  }
  [[nodiscard]] std::uint64_t hash(std::size_t k) const { return states[k]->content_hash(); }
};

void expect_same_cage(const SlabMesh& read, const SlabMesh& was) {
  EXPECT_TRUE(std::ranges::equal(read.cuts(), was.cuts()));
  EXPECT_TRUE(std::ranges::equal(read.roots(), was.roots(), [](const Slab& a, const Slab& b) {
    return a.fibres == b.fibres && a.intervals == b.intervals;
  }));
  EXPECT_EQ(read.root_fibres().size(), was.root_fibres().size());
}

/// Walks through all states in ways of all kinds.
void expect_all(const Session& session, const std::filesystem::path& path) {
  const std::size_t last = session.states.size() - 1;
  RELIEF_MUST(file, ModelFile::open(path));
  ASSERT_EQ(file.stroke_count(), last);
  EXPECT_EQ(file.model().head->content_hash(), session.hash(last));
  expect_same_cage(file.model().head->slab_mesh(), session.head()->slab_mesh());
  std::mt19937 random(5);
  for (std::size_t k = 0; k <= last; ++k) {
    RELIEF_MUST(state, file.at(k));
    EXPECT_EQ(state->content_hash(), session.hash(k)) << k;
    const std::size_t from = random() % (last + 1);
    RELIEF_MUST(near, file.at(k, session.states[from], from));
    EXPECT_EQ(near->content_hash(), session.hash(k)) << from << " to " << k;
  }
  RELIEF_MUST(damage, file.damage());
  EXPECT_TRUE(damage.empty());
  for (std::size_t k = last; k-- > 0;) {
    EXPECT_OK(file.undo());
    EXPECT_EQ(file.model().head->content_hash(), session.hash(k)) << k;
    expect_same_cage(file.model().head->slab_mesh(), session.states[k]->slab_mesh());
  }
  for (std::size_t k = 0; k < last;) {
    const std::size_t steps = std::min<std::size_t>(1 + random() % 3, last - k);
    EXPECT_OK(file.redo(steps));
    k += steps;
    EXPECT_EQ(file.model().head->content_hash(), session.hash(k)) << k;
  }
}

/// Strokes of all kinds, in an order of their own.
void do_all_kinds(Session& session, int strokes, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (int k = 0; k < strokes; ++k) {
    const SnapshotPtr& head = session.head();
    const SlabMesh& mesh = head->slab_mesh();
    const auto slab = static_cast<SlabId>(random() % mesh.slab_count());
    const bool coloured = head->has(Layer::Colour);
    switch (random() % 9) {
      case 0:
      case 1:
        session.commit(mesh.level(slab) < 3 ? stroke(with_cut(head, slab), random()) : stroke(head, random()));
        break;
      case 2:
        session.commit(mesh.level(slab) < 3 ? with_cut(head, slab) : stroke(head, random()));
        break;
      case 3:
        session.commit(mesh.intervals(slab) <= 16 ? with_grid(head, Layer::Displacement, slab, 2)
                                                  : stroke(head, random()));
        break;
      case 4:
        session.commit(coloured ? painted(head, slab, 0.25F) : painted(with_colour(head, 8), slab, 0.5F));
        break;
      case 5:
        session.commit(coloured && head->intervals(Layer::Colour, slab) <= 16 ? with_grid(head, Layer::Colour, slab, 4)
                                                                              : stroke(head, random()));
        break;
      case 6:
        session.commit(coloured ? without(head, Layer::Colour) : stroke(head, random()));
        break;
      case 7:
        session.commit(with_moved_fibre(head, static_cast<FibreId>(random() % mesh.root_fibres().size()), 0.01));
        break;
      default:
        session.commit(stroke(head, random()));
    }
  }
}

TEST(CagesByStroke, EveryStateComesBackToTheBit) {
  for (const auto& [levels, n] : {std::pair(1, 4), std::pair(2, 6), std::pair(1, 15)}) {
    const Folder folder;
    Session session(folder / "a.relief", ball(levels, n));
    do_all_kinds(session, 40, static_cast<std::uint32_t>(levels * 100 + n));
    session.file.reset();
    expect_all(session, session.path);
    EXPECT_OK(ModelFile::copy(session.path, folder / "copy.relief"));
    expect_all(session, folder / "copy.relief");
    RELIEF_MUST(saved, ModelFile::salvage(session.path, folder / "saved.relief"));
    EXPECT_EQ(saved.first, 0U);
    EXPECT_TRUE(saved.lost.empty());
    expect_all(session, folder / "saved.relief");
  }
}

TEST(CagesByStroke, TheCageIsToldAsAWholeNowAndThen) {
  const Folder folder;
  Session session(folder / "a.relief", ball(2, 8));
  std::mt19937 random(7);
  for (int k = 0; k < 150; ++k) {
    const auto slab = static_cast<SlabId>(random() % session.head()->slab_mesh().slab_count());
    session.commit(k % 5 == 4 ? stroke(session.head(), random())
                   : session.head()->slab_mesh().level(slab) < 3
                       ? stroke(with_cut(session.head(), slab), random())
                       : with_moved_fibre(session.head(), 3, k % 2 == 0 ? 0.01 : -0.01));
  }
  session.file.reset();
  expect_all(session, session.path);
}

/// A page that is written whole, as it is now and then, does not lead back to what had been carried there.
TEST(CagesByStroke, PagesThatAreWrittenWholeAfterACutAreLeftBackwards) {
  const Folder folder;
  Session session(folder / "a.relief", ball(1, 4));
  session.commit(stroke(with_cut(session.head(), 3), 1));
  for (std::uint64_t k = 0; k < 70; ++k) {
    SnapshotDraft draft(session.head());
    dab(draft, Layer::Displacement, 3, static_cast<float>(k) / 100);
    session.commit(draft.finish());
  }
  session.file.reset();
  expect_all(session, session.path);
}

TEST(CagesByStroke, AnotherCageMayComeAndFewerCuts) {
  const Folder folder;
  Session session(folder / "a.relief", ball(2, 4));
  session.commit(with_cut(session.head(), 5));
  session.commit(painted(with_colour(session.head(), 8), 5, 0.5F));
  const SnapshotPtr before = session.head();
  session.commit(stroke(with_cut(session.head(), 5), 1));
  session.commit(stroke(with_cut(session.head(), 70), 2));
  session.commit(before);
  session.commit(stroke(session.head(), 3));
  session.commit(ball(1, 6).head);
  session.commit(testing::halved(session.head(), 9).model);
  session.commit(with_cut(session.head(), 31));
  session.commit(with_colour(session.head(), 4));
  session.commit(painted(with_cut(session.head(), 2), 2, 0.5F));
  session.commit(with_colour(session.head(), 16));
  session.commit(before);
  session.file.reset();
  expect_all(session, session.path);
}

TEST(CagesByStroke, TheModelIsKnownAsItWasWhenItsSlabsWereNew) {
  const Folder folder;
  const auto path = folder / "made.relief";
  const SnapshotPtr first = ball().head;
  const auto askew = testing::mapped_shell(*testing::sphere_shell(1, 8), testing::turned_askew);
  const SnapshotPtr anew = testing::displaced(askew, [](Vec3d) { return 0.6; });
  const SnapshotPtr same_corners =
      testing::displaced(testing::mapped_shell(first->slab_mesh(), testing::turned_askew), [](Vec3d) { return 0.5; });
  {
    auto file = ModelFile::create(path, {.info = ball().info, .head = first});
    ASSERT_TRUE(file) << file.error().message;
    const auto commit = [&](SnapshotPtr head) { ASSERT_TRUE(file->commit(std::move(head), {.label = "stroke"})); };
    // More changes than the cage is told by steps: then it is told as a whole, with the same slabs.
    SnapshotPtr head = first;
    for (int k = 0; k < 70; ++k) commit(head = with_moved_fibre(head, 3, 1e-3));
    commit(head = with_cut(head, 5));
    commit(anew);
    commit(with_moved_fibre(anew, 2, 1e-3));
    commit(testing::halved(anew, 7).model);
    commit(first);  // a third model in the same file, with slabs like the first one's
    commit(with_cut(first, 5));
    commit(same_corners);
  }
  const auto file = ModelFile::open(path, true);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->first_state(), FirstState::AsMade);
  for (const std::uint64_t stroke : {0, 1, 70, 71})
    EXPECT_EQ((*file->as_made(stroke))->content_hash(), first->content_hash()) << stroke;
  for (const std::uint64_t stroke : {72, 73, 74})
    EXPECT_EQ((*file->as_made(stroke))->content_hash(), anew->content_hash()) << stroke;
  for (const std::uint64_t stroke : {75, 76}) {
    EXPECT_EQ((*file->as_made(stroke))->content_hash(), first->content_hash()) << stroke;
    EXPECT_EQ((*file->as_made(stroke))->slab_mesh().cuts().size(), first->slab_mesh().cuts().size());
  }
  EXPECT_EQ((*file->as_made(77))->content_hash(), same_corners->content_hash());
  EXPECT_EQ(file->as_made(78).error().code, Errc::NotFound);
}

TEST(CagesByStroke, AFileThatBeginsWithASculptedModelSaysSo) {
  const Folder folder;
  const auto path = folder / "sculpted.relief", copy = folder / "copy.relief", saved = folder / "saved.relief";
  {
    auto file = ModelFile::create(path, ball(), {}, FirstState::Sculpted);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(file->first_state(), FirstState::Sculpted);
    ASSERT_TRUE(file->commit(with_cut(ball().head, 5), {.label = "stroke"}));
  }
  ASSERT_TRUE(ModelFile::copy(path, copy));
  ASSERT_TRUE(ModelFile::salvage(path, saved));
  for (const auto& place : {path, copy, saved}) {
    const auto file = ModelFile::open(place, true);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_EQ(file->first_state(), FirstState::Sculpted);
    for (const std::uint64_t stroke : {0, 1}) {
      const auto made = file->as_made(stroke);
      ASSERT_TRUE(made) << made.error().message;
      EXPECT_EQ(*made, nullptr);
    }
  }
}

TEST(CagesByStroke, ANewFileHasTheCutsOfItsModel) {
  const Folder folder;
  Model model = ball(1, 8);
  model.head = painted(with_colour(with_cut(with_cut(model.head, 3), 3), 16), 3, 0.5F);
  model.head = with_grid(model.head, Layer::Displacement, 7, 2);
  Session session(folder / "a.relief", model);
  session.commit(stroke(with_cut(session.head(), 9), 1));
  session.commit(stroke(session.head(), 2));
  session.file.reset();
  expect_all(session, session.path);
}

TEST(CagesByStroke, StrokesThatWereUndoneLeaveNothing) {
  const Folder folder;
  Session session(folder / "a.relief", ball(1, 8));
  session.commit(with_cut(session.head(), 3));
  for (SlabId s = 10; s < 15; ++s) EXPECT_OK(session.file->commit(with_cut(session.file->model().head, s), {}));
  EXPECT_OK(session.file->undo(5));
  session.commit(stroke(with_cut(session.head(), 20), 5));
  EXPECT_OK(session.file->go_to(1, session.states[1]));
  EXPECT_EQ(session.file->go_to(2, session.states[1]).error().code, Errc::InvalidArgument);
  EXPECT_EQ(session.file->go_to(1, session.states[2]).error().code, Errc::InvalidArgument);
  EXPECT_OK(session.file->go_to(2, session.states[2]));
  session.file.reset();
  expect_all(session, session.path);
}

TEST(CagesByStroke, EqualTilesAndCagesAreShared) {
  const Folder folder;
  Session session(folder / "a.relief", ball(2, 8));
  session.commit(with_cut(session.head(), 3));
  session.commit(stroke(session.head(), 2));
  session.commit(with_cut(session.head(), 100));
  for (const std::size_t from : {0U, 1U, 2U, 3U})
    for (const std::size_t to : {0U, 1U, 2U, 3U}) {
      RELIEF_MUST(state, session.file->at(to, session.states[from], from));
      const Snapshot &a = *session.states[from], &b = *session.states[to];
      if (from == to || (from != 0 && to != 0 && from != 3 && to != 3)) {
        EXPECT_EQ(&state->slab_mesh(), &a.slab_mesh());
      }
      const SlabId both = std::min(a.slab_mesh().slab_count(), b.slab_mesh().slab_count());
      for (SlabId s = 0; s < both; ++s)
        if (a.tile(Layer::Displacement, s).same_values(b.tile(Layer::Displacement, s))) {
          EXPECT_EQ(state->shared_tile(Layer::Displacement, s), a.shared_tile(Layer::Displacement, s)) << s;
        }
    }
}

std::int64_t bytes_of(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(handle, sql.c_str(), -1, &statement, nullptr), SQLITE_OK);
  EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
  const std::int64_t found = sqlite3_column_int64(statement, 0);
  sqlite3_finalize(statement);
  sqlite3_close(handle);
  return found;
}

/// A cut is told by its slab: of its tiles, nothing but room for them in proportion.
TEST(CagesByStroke, WhatFollowsFromBeforeTakesNextToNoRoom) {
  const Folder folder;
  Session session(folder / "a.relief", ball(2, 32));
  SnapshotPtr next = session.head();
  for (SlabId s = 0; s < 30; ++s) next = with_cut(next, 4 * s);
  session.commit(next);
  const std::string of_stroke = " WHERE stroke = 1";
  EXPECT_EQ(bytes_of(session.path, "SELECT count(*) FROM pages" + of_stroke), 0);
  const std::int64_t cage = bytes_of(session.path, "SELECT sum(length(data)) FROM cage WHERE part LIKE '1 %'");
  const std::size_t tiles = 4 * (next->slab_mesh().cuts().size()) * sample_count(16) * sizeof(float);
  EXPECT_LT(cage, 1000 + static_cast<std::int64_t>(tiles / 200));
}

/// Runs SQL on a file behind the back of its program.
void run_sql(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
  sqlite3_close(handle);
}

std::vector<std::string> names_in(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(handle, sql.c_str(), -1, &statement, nullptr), SQLITE_OK);
  std::vector<std::string> names;
  while (sqlite3_step(statement) == SQLITE_ROW)
    names.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(statement, 0)));
  sqlite3_finalize(statement);
  sqlite3_close(handle);
  return names;
}

// ---- Older formats

/// A file of an older format takes cuts, and is one of format 4 from then on.
TEST(CagesByStroke, FilesOfOlderFormatsTakeThem) {
  for (const int format : {1, 2, 3}) {
    const Folder folder;
    const auto path = folder / "a.relief";
    std::filesystem::copy_file(
        std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data" / ("format-" + std::to_string(format) + ".relief"),
        path);
    std::vector<std::uint64_t> hashes;
    {
      RELIEF_MUST(file, ModelFile::open(path));
      for (std::uint64_t k = 0; k <= file.stroke_count(); ++k) hashes.push_back((*file.at(k))->content_hash());
      EXPECT_OK(file.commit(stroke(file.model().head, 7), {}));
      hashes.push_back(file.model().head->content_hash());
      EXPECT_EQ(bytes_of(path, "PRAGMA user_version"), format) << "a stroke that leaves the cage alone";
      for (const SlabId slab : {3U, 3U, 9U}) {
        EXPECT_OK(file.commit(with_cut(file.model().head, slab), {}));
        hashes.push_back(file.model().head->content_hash());
        EXPECT_OK(file.commit(painted(file.model().head, slab, 0.3F), {}));
        hashes.push_back(file.model().head->content_hash());
        EXPECT_OK(file.commit(stroke(file.model().head, slab), {}));
        hashes.push_back(file.model().head->content_hash());
      }
      EXPECT_EQ(bytes_of(path, "PRAGMA user_version"), 4);
    }
    RELIEF_MUST(file, ModelFile::open(path));
    ASSERT_EQ(file.stroke_count(), hashes.size() - 1);
    for (std::size_t k = 0; k < hashes.size(); ++k) {
      RELIEF_MUST(state, file.at(k));
      EXPECT_EQ(state->content_hash(), hashes[k]) << "format " << format << ", stroke " << k;
    }
    RELIEF_MUST(saved, ModelFile::salvage(path, folder / "saved.relief"));
    EXPECT_EQ(saved.last, hashes.size() - 1);
    EXPECT_EQ(testing::saved_hash(folder / "saved.relief"), hashes.back());
  }
}

/// The first with cuts. Whoever changes the rule by which tiles are carried over finds out here that this file still
/// needs the old one.
TEST(CagesByStroke, FilesOfFormat4Open) {
  const auto golden = std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data/format-4.relief";
  if (std::getenv("RELIEF_WRITE_GOLDEN") != nullptr) {
    Model model = ball(1, 4);
    model.head = testing::with_hole(model.head, [](Vec3d p) { return p.y > 0.5; });
    Session session(golden, model);
    session.commit(painted(with_colour(session.head(), 6), 3, 0.5F));
    session.commit(stroke(with_cut(with_cut(session.head(), 3), 3), 1));
    session.commit(with_grid(session.head(), Layer::Colour, 7, 4));
    session.commit(with_moved_fibre(session.head(), 2, 0.25));
    session.commit(with_grid(with_cut(session.head(), 9), Layer::Displacement, 20, 2));
    EXPECT_OK(session.file->undo());
  }
  const Folder folder;
  std::filesystem::copy_file(golden, folder / "a.relief");
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_EQ(file.stroke_count(), 4U);
  const std::vector<std::uint64_t> hashes = {0x6262442d022173daU, 0x484d811fcd61323dU, 0x2361993977cf901U,
                                             0x893ef0c7ccbe42d6U, 0x5322832a77cecaa4U, 0xe6ee21aad73102d8U};
  for (std::size_t k = 0; k < hashes.size(); ++k) {
    RELIEF_MUST(state, file.at(k));
    EXPECT_EQ(state->content_hash(), hashes[k]) << k << ": " << std::hex << state->content_hash();
  }
  EXPECT_OK(file.redo());
  EXPECT_OK(file.commit(stroke(with_cut(file.model().head, 12), 5), {}));
}

// ---- What was proven

TEST(CagesByStroke, MovedFibresArePutToTheProof) {
  const Folder folder;
  const auto on_lattice = [](Vec3d p) {
    const auto snap = [](double x) { return std::round(x * 1024) / 1024; };
    return Vec3d{snap(p.x), snap(p.y), snap(p.z)};
  };
  const auto rough = testing::sphere_shell(2, 4);
  std::vector<Fibre> fibres;
  for (const Fibre& f : rough->fibres()) fibres.push_back({on_lattice(f.inner), on_lattice(f.outer)});
  std::vector<SlabMesh::Face> faces;
  for (const Slab& s : rough->slabs()) faces.push_back({s.fibres, s.intervals});
  Model model = ball();
  model.head = Snapshot::make(std::make_shared<const SlabMesh>(SlabMesh::make(fibres, faces).value()));
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  EXPECT_EQ(file.doubt(), "");
  EXPECT_OK(file.commit(with_cut(with_cut(file.model().head, 5), 5), {}));
  EXPECT_EQ(file.doubt(), "") << "cuts take nothing from what was proven of the roots";
  // Twice as long, outwards, on the lattice still; then turned round.
  EXPECT_OK(file.commit(with_moved_fibre(file.model().head, 3, 1.0), {}));
  EXPECT_EQ(file.doubt(), "");
  EXPECT_EQ(names_in(folder / "a.relief", "SELECT part FROM cage WHERE part LIKE '2 %' ORDER BY part"),
            (std::vector<std::string>{"2 certificate", "2 moved fibres"}));
  EXPECT_OK(file.commit(with_moved_fibre(file.model().head, 3, -3.0), {}));
  EXPECT_NE(file.doubt().find("C1"), std::string::npos) << "doubt: " << file.doubt();
  EXPECT_OK(file.undo());
  EXPECT_EQ(file.doubt(), "");
}

// ---- Damage

/// Whatever row is lost: what is said to be readable is the true state, and salvage saves the newest of these.
TEST(DamagedCage, WhatIsReadableIsTrue) {
  const Folder folder;
  Session session(folder / "a.relief", ball(1, 4));
  do_all_kinds(session, 12, 4);
  for (int k = 0; k < 66; ++k)
    session.commit(with_moved_fibre(session.head(), static_cast<FibreId>(k % 9), k % 2 == 0 ? 0.001 : -0.001));
  do_all_kinds(session, 6, 9);
  session.file.reset();
  const std::size_t last = session.states.size() - 1;
  std::vector<std::pair<std::string, std::string>> rows;
  for (const std::string& part : names_in(session.path, "SELECT part FROM cage WHERE part NOT IN ('fibres', 'slabs')"))
    rows.emplace_back("cage", "part = '" + part + "'");
  for (const std::string& rowid : names_in(session.path, "SELECT rowid FROM pages"))
    rows.emplace_back("pages", "rowid = " + rowid);
  std::mt19937 random(1);
  std::ranges::shuffle(rows, random);
  rows.resize(25);
  std::size_t saved_by_whole_cage = 0;
  for (const auto& [table, where] : rows) {
    const auto path = folder / "b.relief";
    std::filesystem::copy_file(session.path, path, std::filesystem::copy_options::overwrite_existing);
    run_sql(path, "UPDATE " + table + " SET hash = hash + 1 WHERE " + where);
    const auto salvaged = ModelFile::salvage(path, folder / "saved.relief");
    const auto opened = ModelFile::open(path, true);
    if (opened) {
      EXPECT_EQ(opened->model().head->content_hash(), session.hash(last));
      RELIEF_MUST(damage, opened->damage());
      for (std::size_t k = random() % 5; k <= last; k += 5) {
        const bool lost = std::ranges::any_of(
            damage, [&](const DamagedStrokes& strokes) { return strokes.first <= k && k <= strokes.last; });
        const auto state = opened->at(k, session.states[last], last);
        if (state)
          EXPECT_EQ((*state)->content_hash(), session.hash(k)) << where << ": " << k;
        else
          EXPECT_TRUE(lost) << where << ": " << k << ": " << state.error().message;
      }
      EXPECT_EQ(damage.empty(), where.contains("certificate")) << where;
      saved_by_whole_cage += !damage.empty() && damage.back().last < last ? 1 : 0;
    }
    if (salvaged) {
      EXPECT_EQ(testing::saved_hash(folder / "saved.relief"), session.hash(salvaged->current)) << where;
      if (opened) {
        EXPECT_EQ(salvaged->current, last) << where;
      }
    } else {
      EXPECT_EQ(where.find("cage"), std::string::npos) << salvaged.error().message;
    }
  }
  EXPECT_GT(saved_by_whole_cage, 3U) << "what comes before the cage was told as a whole is not needed after it";
}

/// Puts other bytes into a part of the cage, with a checksum that holds.
void forge(const std::filesystem::path& path, const std::string& part, const std::vector<std::byte>& blob) {
  Hash64 hash;
  hash.add_bytes(std::as_bytes(std::span(part)));
  hash.add_bytes(blob);
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* put = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(handle, "UPDATE cage SET hash = ?, data = ? WHERE part = ?", -1, &put, nullptr),
            SQLITE_OK);
  sqlite3_bind_int64(put, 1, std::bit_cast<std::int64_t>(hash.value()));
  sqlite3_bind_blob(put, 2, blob.data(), static_cast<int>(blob.size()), SQLITE_TRANSIENT);
  sqlite3_bind_text(put, 3, part.c_str(), -1, SQLITE_TRANSIENT);
  EXPECT_EQ(sqlite3_step(put), SQLITE_DONE);
  EXPECT_EQ(sqlite3_changes(handle), 1) << part;
  sqlite3_finalize(put);
  sqlite3_close(handle);
}

template <typename Value>
std::vector<std::byte> packed(const std::vector<Value>& values, std::size_t width = sizeof(Value),
                              std::size_t expansion = 1) {
  return detail::pack(std::as_bytes(std::span(values)), width, expansion);
}

TEST(ForgedCage, IsRefusedWithAReason) {
  const Folder folder;
  Session session(folder / "a.relief", ball(1, 4));
  session.commit(with_cut(session.head(), 3));
  session.commit(with_grid(session.head(), Layer::Displacement, 5, 2));
  session.commit(with_moved_fibre(session.head(), 2, 0.01));
  session.file.reset();
  const auto refused = [&](const std::string& part, const std::vector<std::byte>& blob, const char* word) {
    const auto path = folder / "b.relief";
    std::filesystem::copy_file(session.path, path, std::filesystem::copy_options::overwrite_existing);
    forge(path, part, blob);
    const auto opened = ModelFile::open(path);
    ASSERT_FALSE(opened) << part << ' ' << word;
    EXPECT_NE(opened.error().message.find(word), std::string::npos) << opened.error().message;
    EXPECT_LT(opened.error().message.size(), 450U);
    (void)ModelFile::salvage(path, folder / "saved.relief");
  };
  using Numbers = std::vector<std::uint32_t>;
  refused("1 new cuts", packed(Numbers{4000000000U}), "cannot be cut");
  refused("1 new cuts", packed(Numbers{32}), "cannot be cut");
  refused("1 new cuts", packed(Numbers(30, 3)), "cannot be cut");
  refused("1 new cuts", packed(Numbers{3, 3, 3}), "share an edge");
  refused("1 new cuts", packed(Numbers(100000, 3), 4, 256), "claims more than it can hold");
  refused("1 new cuts", packed(std::vector<std::uint8_t>{1, 2, 3}), "claims more than it can hold");
  refused("1 new cuts", std::vector<std::byte>(9), "claims more than it can hold");
  refused("1 carried", packed(Numbers{2}), "rule 2");
  refused("2 new grid of displacement", packed(Numbers{5, 129}), "grid");
  refused("2 new grid of displacement", packed(Numbers{5, 0}), "grid");
  refused("2 new grid of displacement", packed(Numbers{500, 8}), "grid");
  refused("2 new grid of displacement", packed(Numbers{5, 128}), "more tiles than it can hold");
  refused("2 new grid of displacement", packed(Numbers{5, 6}), "do not differ by a power of two");
  refused("3 moved fibres", packed(std::vector<double>{99, 0, 0, 0, 1, 1, 1}), "a fibre that does not exist");
  refused("3 moved fibres", packed(std::vector<double>{std::nan(""), 0, 0, 0, 1, 1, 1}), "does not exist");
  refused("3 moved fibres", packed(std::vector<double>{2, 0, 0, 0, 0, 0, 0}), "fibre 2");
  refused("3 moved fibres", packed(std::vector<double>{2, 0, 0}), "wrong size");
}

/// Rows of the cage that mean nothing are refused, too; so are numbers of strokes in other spellings.
TEST(ForgedCage, RowsThatNoStrokeWroteAreMissed) {
  const Folder folder;
  Session session(folder / "a.relief", ball(1, 4));
  session.commit(with_cut(session.head(), 3));
  session.file.reset();
  for (const char* sql :
       {"INSERT INTO cage VALUES('1 wishes', 0, x'00')", "DELETE FROM cage WHERE part = '1 carried'",
        "UPDATE cage SET part = '01 new cuts' WHERE part = '1 new cuts'", "INSERT INTO cage VALUES('new cuts', 0, x'')",
        "UPDATE cage SET part = '2 new cuts' WHERE part = '1 new cuts'"}) {
    const auto path = folder / "b.relief";
    std::filesystem::copy_file(session.path, path, std::filesystem::copy_options::overwrite_existing);
    run_sql(path, sql);
    const auto opened = ModelFile::open(path);
    EXPECT_FALSE(opened) << sql;
  }
}

}  // namespace
}  // namespace relief
