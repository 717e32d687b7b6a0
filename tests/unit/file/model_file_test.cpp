// Saving, opening, strokes, undo, copies, and what happens beside other programs.
#include <sqlite3.h>
#include <support/canceller.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unit/file/file_support.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <limits>

namespace relief {
namespace {

using testing::ball;
using testing::Canceller;
using testing::code;
using testing::dab;
using testing::displaced;
using testing::Folder;
using testing::mixed_shell;
using testing::read_file;
using testing::saved_hash;
using testing::sphere_shell;
using testing::stroke;
using testing::times_stopped;
using testing::write_file;

TEST(ModelFile, KeepsAModel) {
  const Folder folder;
  const Model model = ball();
  {
    RELIEF_MUST(made, ModelFile::create(folder / "a.relief", model));
    EXPECT_EQ(made.model().head, model.head) << "no need to read back what the caller holds";
  }
  for (const bool read_only : {false, true}) {
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief", read_only));
    EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash());
    EXPECT_EQ(file.model().info.mode, Mode::Certified);
    EXPECT_EQ(file.model().info.unit, Unit::Centimetre);
    EXPECT_EQ(file.model().info.source, "ball \"1\".ply");
    EXPECT_EQ(file.model().info.source_diagonal, 2.5);
    EXPECT_EQ(file.stroke_count(), 0U);
    EXPECT_EQ(file.redo_count(), 0U);
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"}) << "one model, one file";
}

TEST(ModelFile, KeepsAllLayersAndEveryGridSize) {
  const Folder folder;
  for (const int n : {0, 1, 15, 33, 128}) {
    Model model = n > 0 ? ball(1, n) : ball(mixed_shell(*sphere_shell(1, 1), 3, 3));
    SnapshotDraft draft(model.head);
    for (int k = 1; k < kLayerCount; ++k) {
      const auto layer = static_cast<Layer>(k);
      draft.add_layer(layer, has_own_intervals(layer) ? kOwnIntervals : n == 128 ? 5 : n + k, 0.25F);
      dab(draft, layer, 3, 0.75F);
    }
    model.head = draft.finish();
    ASSERT_TRUE(ModelFile::create(folder / "a.relief", model).has_value());
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
    EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash()) << n;
  }
}

TEST(ModelFile, StrokesUndoRedoAndBranches) {
  const Folder folder;
  const Model model = ball();
  std::vector<std::uint64_t> hashes = {model.head->content_hash()};
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    SnapshotPtr head = model.head;
    for (std::uint64_t k = 1; k <= 5; ++k) {
      head = stroke(head, k);
      hashes.push_back(head->content_hash());
      EXPECT_OK(file.commit(head, {.label = "stroke " + std::to_string(k), .details = "{\"k\": \"'\n\"}"}));
      EXPECT_EQ(file.model().head, head);
    }
    EXPECT_EQ(file.stroke_count(), 5U);
  }
  {
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
    EXPECT_EQ(file.model().head->content_hash(), hashes[5]);
    RELIEF_MUST(records, file.strokes());
    ASSERT_EQ(records.size(), 5U);
    EXPECT_EQ(records[2].number, 3U);
    EXPECT_EQ(records[2].label, "stroke 3");
    EXPECT_EQ(records[2].details, "{\"k\": \"'\n\"}");
    EXPECT_GT(records[2].tiles, 3U);
    EXPECT_LT(records[2].tiles, 20U);
    RELIEF_MUST(undone, file.undo(2));
    EXPECT_EQ(undone, 2U);
    EXPECT_EQ(file.model().head->content_hash(), hashes[3]);
    EXPECT_EQ(file.redo_count(), 2U);
  }
  {
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
    EXPECT_EQ(file.model().head->content_hash(), hashes[3]) << "undo is kept";
    RELIEF_MUST(redone, file.redo(9));
    EXPECT_EQ(redone, 2U);
    EXPECT_EQ(file.model().head->content_hash(), hashes[5]);
    RELIEF_MUST(undone, file.undo(100));
    EXPECT_EQ(undone, 5U);
    EXPECT_EQ(file.model().head->content_hash(), hashes[0]);
    RELIEF_MUST(none, file.undo());
    EXPECT_EQ(none, 0U);
    RELIEF_MUST(again, file.redo());
    EXPECT_EQ(again, 1U);
    const SnapshotPtr other = stroke(file.model().head, 50);
    EXPECT_OK(file.commit(other, {.label = "another way"}));
    EXPECT_EQ(file.stroke_count(), 2U);
    EXPECT_EQ(file.redo_count(), 0U);
    hashes[2] = other->content_hash();
  }
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief", true));
  EXPECT_EQ(file.model().head->content_hash(), hashes[2]);
  RELIEF_MUST(records, file.strokes());
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(records[1].label, "another way");
}

TEST(ModelFile, AnyStrokeCanBeReadNearAnyOther) {
  const Folder folder;
  const Model model = ball();
  std::vector<SnapshotPtr> states = {model.head};
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  for (std::uint64_t k = 1; k <= 6; ++k) {
    SnapshotDraft draft(stroke(states.back(), k));
    if (k == 4) draft.add_layer(Layer::Colour, 5, 1.0F);
    states.push_back(draft.finish());
    EXPECT_OK(file.commit(states.back(), {}));
  }
  EXPECT_OK(file.undo(2));
  RELIEF_MUST(reader, ModelFile::open(folder / "a.relief", true));
  for (ModelFile* of : {&file, &reader})
    for (std::uint64_t to = 0; to <= 6; ++to) {
      for (std::uint64_t from = 0; from <= 6; ++from) {
        RELIEF_MUST(state, of->at(to, states[from], from));
        EXPECT_EQ(state->content_hash(), states[to]->content_hash()) << from << " to " << to;
      }
      RELIEF_MUST(state, of->at(to));
      EXPECT_EQ(state->content_hash(), states[to]->content_hash());
    }
  EXPECT_EQ(file.stroke_count(), 4U) << "the current stroke stays";
  RELIEF_MUST(before, file.at(2, states[3], 3));
  std::size_t different = 0;
  for_each_change(*states[3], *before, [&](Layer, SlabId) { ++different; });
  EXPECT_GT(different, 0U);
  EXPECT_LT(different, 20U) << "tiles that are the same are shared";
  EXPECT_EQ(file.at(7).error().code, Errc::NotFound);
  EXPECT_OK(file.commit(states[1], {}));
  EXPECT_EQ(reader.at(2).error().code, Errc::Io) << "another program has changed what the reader saw";
}

TEST(ModelFile, OpeningTellsOnePhaseAndTheCheckOfTheTablesStopsAtOnce) {
  const Folder folder;
  const auto path = folder / "a.relief";
  // Values that do not pack.
  Model bumpy = ball(4, 16);
  bumpy.head =
      displaced(sphere_shell(4, 16), [](Vec3d p) { return 0.5 + 0.1 * std::sin(91 * p.x + 57 * p.y + 23 * p.z); });
  ASSERT_TRUE(ModelFile::create(path, bumpy).has_value());
  constexpr int kPages = 200;  // so many that each share of the check is a page or more
  ASSERT_GT(std::filesystem::file_size(path), kPages * 4096U);
  double last = -1;
  const auto whole = ModelFile::open(path, true, {.report = [&](std::string_view phase, double share) {
                                       EXPECT_EQ(phase, "open");
                                       EXPECT_GE(share, last);
                                       last = share;
                                     }});
  EXPECT_OK(whole);
  EXPECT_DOUBLE_EQ(last, 1);
  // A check that went on to its end after the cancel would go on to tell its shares.
  std::atomic<bool> stop = false;
  int after = 0;
  const auto stopped = ModelFile::open(path, true,
                                       {.report =
                                            [&](std::string_view, double share) {
                                              if (stop) ++after;
                                              if (share > 0) stop = true;
                                            },
                                        .cancel = &stop});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::Cancelled);
  EXPECT_LE(after, 2);
}

/// Another process writes into a database; whether it could.
bool written_by_another(const std::filesystem::path& file) {
  const std::string script = "import sqlite3; sqlite3.connect('" + file.string() +
                             "', timeout=0, isolation_level=None).execute('CREATE TABLE other (x)')";
  return std::system(("python3 -c \"" + script + "\" 2>/dev/null").c_str()) == 0;
}

TEST(ModelFile, WhatAnotherProgramWroteIsNotWrittenOver) {
  const Folder folder;
  const Model model = ball();
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  const SnapshotPtr next = stroke(model.head, 1);
  EXPECT_OK(file.commit(next, {.label = "one", .details = {}}));
  EXPECT_FALSE(written_by_another(folder / "a.relief")) << "it is ours while it is open";
  // A process that opens and closes a file has no POSIX lock on it any more: file dialogs do so.
  {
    std::ifstream(folder / "a.relief", std::ios::binary).peek();
  }
  ASSERT_TRUE(written_by_another(folder / "a.relief"));
  const auto refused = file.commit(stroke(next, 2), {.label = "two", .details = {}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::Io);
  EXPECT_NE(refused.error().message.find("was changed by another program"), std::string::npos);
}

TEST(ModelFile, WhatAnotherProgramWritesBetweenTwoOfOurTransactionsIsSeen) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Model model = ball(0, 1);
  ASSERT_TRUE(ModelFile::create(path, model).has_value());
  // Tries to write again and again; our lock is open for a moment only, at each commit. It begins once the file is
  // ours, and was made before, so that it knows nothing of our locks.
  std::array<int, 2> begin{};
  ASSERT_EQ(::pipe(begin.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::close(begin[1]);
    sqlite3* handle = nullptr;
    char go = 0;
    if (::read(begin[0], &go, 1) != 1) ::_exit(1);
    if (sqlite3_open(path.c_str(), &handle) != SQLITE_OK) ::_exit(1);
    while (sqlite3_exec(handle, "UPDATE strokes SET label = 'other'", nullptr, nullptr, nullptr) != SQLITE_OK) {
    }
    sqlite3_close(handle);
    ::_exit(0);
  }
  RELIEF_MUST(file, ModelFile::open(path));
  ASSERT_EQ(::write(begin[1], "g", 1), 1);
  SnapshotPtr head = model.head;
  int status = 0;
  Status done;
  constexpr std::uint64_t kTries = 5000;
  bool came = false;
  for (std::uint64_t k = 1; done && k <= kTries && !came; ++k) {
    head = stroke(head, k);
    done = file.commit(head, {.label = "ours", .details = {}});
    came = ::waitpid(child, &status, WNOHANG) != 0;
  }
  if (!came) {
    ::kill(child, SIGKILL);
    ::waitpid(child, &status, 0);
  }
  ::close(begin[0]);
  ::close(begin[1]);
  if (done && !came) GTEST_SKIP() << "the other program was never quick enough to come between";
  if (done) done = file.commit(stroke(head, 1000), {.label = "ours", .details = {}});
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("was changed by another program"), std::string::npos) << done.error().message;
  EXPECT_EQ(file.at(0).error().code, Errc::Io) << "nor are its rows read as ours";
  RELIEF_MUST(reader, ModelFile::open(path, true));
  RELIEF_MUST(strokes, reader.strokes());
  for (const StrokeRecord& stroke : strokes) EXPECT_TRUE(stroke.damaged || stroke.label == "other");
}

TEST(ModelFile, AStrokeWhoseModelIsAtHandIsGoneToWithoutReading) {
  const Folder folder;
  const Model model = ball();
  std::vector<SnapshotPtr> states = {model.head};
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    for (std::uint64_t k = 1; k <= 4; ++k) {
      SnapshotDraft draft(stroke(states.back(), k));
      if (k == 3) draft.add_layer(Layer::Colour, 5, 1.0F);
      states.push_back(draft.finish());
      EXPECT_OK(file.commit(states.back(), {}));
    }
    EXPECT_OK(file.go_to(1, states[1]));
    EXPECT_EQ(file.model().head, states[1]);
    EXPECT_EQ(file.stroke_count(), 1U);
    EXPECT_EQ(file.redo_count(), 3U);
    EXPECT_EQ(file.go_to(3, states[2]).error().code, Errc::InvalidArgument) << "it lacks the colour of stroke 3";
    EXPECT_EQ(file.go_to(5, states[4]).error().code, Errc::NotFound);
    EXPECT_EQ(file.stroke_count(), 1U);
    EXPECT_OK(file.go_to(4, states[4]));
    EXPECT_OK(file.go_to(2, states[2]));
  }
  EXPECT_EQ(saved_hash(folder / "a.relief"), states[2]->content_hash());
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_EQ(file.redo_count(), 2U);
  EXPECT_OK(file.redo(2));
  EXPECT_EQ(file.model().head->content_hash(), states[4]->content_hash());
}

TEST(ModelFile, AllThatTakesTimeCanBeCancelledAtAnyMoment) {
  const Folder folder;
  const Model model = ball(3, 4);
  SnapshotDraft draft(model.head);
  for (SlabId s = 0; s < model.head->slab_mesh().slab_count(); s += 5) dab(draft, Layer::Displacement, s, 0.25F);
  draft.add_layer(Layer::Colour, 3, 1.0F);
  const SnapshotPtr large = draft.finish();
  const std::uint64_t first = model.head->content_hash(), second = large->content_hash();
  const auto a = folder / "a.relief", b = folder / "b.relief";
  {
    RELIEF_MUST(file, ModelFile::create(a, model));
    EXPECT_OK(file.commit(large, {}));
  }
  const auto stopped = [&](const std::function<Errc(const Progress&)>& work, const std::function<void()>& unchanged) {
    return times_stopped(work, unchanged, 320);
  };
  const auto only = [&](const std::filesystem::path& name) {
    for (const std::string& found : folder.names()) EXPECT_TRUE(found == "a.relief" || found == name) << found;
  };

  EXPECT_GT(stopped([&](const Progress& p) { return code(ModelFile::open(a, true, p)); }, [&] { only(a); }), 5);
  EXPECT_GT(stopped([&](const Progress& p) { return code(ModelFile::open(a, false, p)); }, [&] { only(a); }), 5);
  EXPECT_GT(stopped([&](const Progress& p) { return code(ModelFile::create(b, model, p)); },
                    [&] { EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"}); }),
            5);
  ASSERT_TRUE(ModelFile::create(b, model).has_value());
  Canceller at_once(0);
  at_once.stop = true;
  EXPECT_EQ(ModelFile::copy(a, b, at_once.progress).error().code, Errc::Cancelled);
  EXPECT_EQ(saved_hash(b), first) << "what stood there stays";
  only("b.relief");
  EXPECT_GT(stopped([&](const Progress& p) { return code(ModelFile::copy(a, b, p)); },
                    [&] {
                      EXPECT_EQ(saved_hash(b), first);
                      only("b.relief");
                    }),
            5);
  EXPECT_EQ(saved_hash(b), second);
  ASSERT_TRUE(ModelFile::create(b, model).has_value());
  EXPECT_GT(stopped([&](const Progress& p) { return code(ModelFile::salvage(a, folder / "c.relief", p)); },
                    [&] { only("b.relief"); }),
            5);
  std::filesystem::remove(folder / "c.relief");
  {
    RELIEF_MUST(file, ModelFile::open(b));
    EXPECT_GT(stopped([&](const Progress& p) { return code(file.commit(large, {}, p)); },
                      [&] {
                        EXPECT_EQ(file.stroke_count(), 0U);
                        EXPECT_EQ(file.model().head->content_hash(), first);
                      }),
              5);
    EXPECT_EQ(file.stroke_count(), 1U);
    EXPECT_GT(
        stopped([&](const Progress& p) { return code(file.at(0, p)); }, [&] { EXPECT_EQ(file.stroke_count(), 1U); }),
        5);
    EXPECT_GT(stopped([&](const Progress& p) { return code(file.undo(1, p)); },
                      [&] { EXPECT_EQ(file.model().head->content_hash(), second); }),
              5);
    EXPECT_GT(stopped([&](const Progress& p) { return code(file.redo(1, p)); },
                      [&] { EXPECT_EQ(file.model().head->content_hash(), first); }),
              5);
    EXPECT_EQ(file.damage(at_once.progress).error().code, Errc::Cancelled);
  }
  EXPECT_EQ(saved_hash(b), second);
}

TEST(ModelFile, UndoSharesTilesThatDidNotChange) {
  const Folder folder;
  const Model model = ball();
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  EXPECT_OK(file.commit(stroke(model.head, 1), {}));
  EXPECT_OK(file.undo());
  std::size_t different = 0;
  for_each_change(*model.head, *file.model().head, [&](Layer, SlabId) { ++different; });
  EXPECT_LT(different, 20U);
}

TEST(ModelFile, AStrokeThatAddsALayerIsUndoneWhole) {
  const Folder folder;
  const Model model = ball();
  std::uint64_t painted = 0, finer = 0;
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    SnapshotDraft draft(model.head);
    draft.add_layer(Layer::Colour, 9, 1.0F);
    dab(draft, Layer::Colour, 7, 0.5F);
    SnapshotPtr head = draft.finish();
    EXPECT_OK(file.commit(head, {.label = "first paint"}));
    dab(draft, Layer::Colour, 90, 0.25F);
    head = draft.finish();
    EXPECT_OK(file.commit(head, {.label = "second paint"}));
    painted = head->content_hash();
    draft.add_layer(Layer::Colour, 12, 0.75F);
    head = draft.finish();
    EXPECT_OK(file.commit(head, {.label = "finer colour"}));
    finer = head->content_hash();
  }
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_EQ(file.model().head->content_hash(), finer);
  EXPECT_OK(file.undo());
  EXPECT_EQ(file.model().head->content_hash(), painted);
  EXPECT_OK(file.undo(2));
  EXPECT_FALSE(file.model().head->has(Layer::Colour));
  EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash());
  EXPECT_OK(file.redo(2));
  EXPECT_EQ(file.model().head->content_hash(), painted);
  EXPECT_OK(file.commit(model.head, {.label = "colour taken away"}));
  {
    RELIEF_MUST(reader, ModelFile::open(folder / "a.relief", true));
    EXPECT_FALSE(reader.model().head->has(Layer::Colour));
  }
  EXPECT_OK(file.undo());
  EXPECT_EQ(file.model().head->content_hash(), painted);
}

TEST(ModelFile, ManyStrokesOnOnePlace) {
  const Folder folder;
  const Model model = ball(1, 3);
  std::vector<std::uint64_t> hashes = {model.head->content_hash()};
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    SnapshotPtr head = model.head;
    for (std::uint64_t k = 1; k <= 150; ++k) {
      head = stroke(head, k);
      hashes.push_back(head->content_hash());
      ASSERT_TRUE(file.commit(head, {}).has_value());
    }
  }
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_EQ(file.model().head->content_hash(), hashes[150]);
  for (std::uint64_t k = 150; k >= 10; k -= 10) {
    EXPECT_OK(file.undo(10));
    EXPECT_EQ(file.model().head->content_hash(), hashes[k - 10]);
  }
  EXPECT_OK(file.redo(77));
  EXPECT_EQ(file.model().head->content_hash(), hashes[77]);
}

TEST(ModelFile, RefusesWhatItCouldNotReadBack) {
  const Folder folder;
  const Model model = ball();
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  for (const float bad : {std::nanf(""), -0.5F, 1.5F}) {
    SnapshotDraft draft(model.head);
    draft.edit(Layer::Displacement, 5).plane()[9] = bad;
    const Status status = file.commit(draft.finish(), {});
    ASSERT_FALSE(status.has_value());
    EXPECT_EQ(status.error().code, Errc::InvalidArgument);
    EXPECT_NE(status.error().message.find("slab 5"), std::string::npos) << status.error().message;
  }
  SnapshotDraft torn(model.head);
  torn.edit(Layer::Displacement, 5).plane()[1] = 0.125F;  // on an edge, one side only
  const SnapshotPtr torn_head = torn.finish();
  EXPECT_EQ(file.commit(torn_head, {}).error().code, Errc::InvalidArgument);
  Model broken = model;
  broken.head = torn_head;
  EXPECT_EQ(ModelFile::create(folder / "b.relief", broken).error().code, Errc::InvalidArgument);
  broken = model;
  broken.info.source_diagonal = std::nan("");
  EXPECT_EQ(ModelFile::create(folder / "b.relief", broken).error().code, Errc::InvalidArgument);
  EXPECT_EQ(file.stroke_count(), 0U);
  EXPECT_OK(file.commit(stroke(model.head, 1), {}));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
}

TEST(ModelFile, ReadOnlyFilesAreReadAndNotWritten) {
  const Folder folder;
  const Model model = ball();
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", model).has_value());
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief", true));
  EXPECT_EQ(file.commit(stroke(model.head, 1), {}).error().code, Errc::Io);
  EXPECT_EQ(file.undo().error().code, Errc::Io);
}

/// Runs `work` in a child that may not write what is not its own, also where the administrator runs the tests.
void as_somebody_else(const Folder& folder, const std::function<bool()>& work) {
  ASSERT_EQ(::chmod((folder / ".").c_str(), 0555), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    if (::geteuid() == 0 && ::setuid(kNobody) != 0) ::_exit(2);
    ::_exit(work() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(::chmod((folder / ".").c_str(), 0755), 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST(ModelFile, WhatMayNotBeWrittenIsReadAndTheReasonIsTold) {
  const Folder folder;
  const Model model = ball();
  const auto path = folder / "a.relief";
  ASSERT_TRUE(ModelFile::create(path, model).has_value());
  ASSERT_EQ(::chmod(path.c_str(), 0444), 0);
  as_somebody_else(folder, [&] {
    const auto reader = ModelFile::open(path, true);
    const auto writer = ModelFile::open(path);
    const auto beside = ModelFile::create(folder / "b.relief", model);
    return reader && reader->model().head->content_hash() == model.head->content_hash() && !writer &&
           writer.error().code == Errc::Io && writer.error().message.contains("read-only") && !beside &&
           beside.error().message.contains("b.relief");
  });
  // A change that a killed run left half done cannot be undone there, and is not shown either.
  sqlite3* handle = nullptr;
  ASSERT_EQ(::chmod(path.c_str(), 0644), 0);
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(handle,
                         "PRAGMA cache_size = 1; PRAGMA cache_spill = 1; BEGIN; UPDATE pages SET data = "
                         "zeroblob(9000); UPDATE meta SET value = 'broken'",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  const auto half = folder / "half.relief", journal = folder / "half.relief-journal";
  std::filesystem::copy_file(path, half);
  std::filesystem::copy_file(path.string() + "-journal", journal);
  sqlite3_close(handle);
  ASSERT_EQ(::chmod(half.c_str(), 0444), 0);
  ASSERT_EQ(::chmod(journal.c_str(), 0444), 0);
  as_somebody_else(folder, [&] {
    const auto reader = ModelFile::open(half, true);
    return !reader && reader.error().code == Errc::Io && reader.error().message.contains("unfinished change");
  });
  EXPECT_EQ(saved_hash(half), model.head->content_hash()) << "where it may be written it is undone";
}

TEST(ModelFile, AnotherProgramThatWritesIsInUseUntilItIsGone) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Model model = ball();
  ASSERT_TRUE(ModelFile::create(path, model).has_value());
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto file = ModelFile::open(path);
    const bool wrote = file && file->commit(stroke(model.head, 1), {});
    static_cast<void>(::write(ready[1], wrote ? "y" : "n", 1));
    for (;;) ::pause();
  }
  char wrote = 0;
  ASSERT_EQ(::read(ready[0], &wrote, 1), 1);
  EXPECT_EQ(wrote, 'y');
  const auto second = ModelFile::open(path);
  EXPECT_FALSE(second.has_value());
  if (!second) {
    EXPECT_NE(second.error().message.find("in use"), std::string::npos) << second.error().message;
  }
  EXPECT_FALSE(ModelFile::create(path, model).has_value()) << "nor is its file replaced";
  EXPECT_EQ(saved_hash(path), stroke(model.head, 1)->content_hash()) << "readers are let in";
  ::kill(child, SIGKILL);
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  ::close(ready[0]);
  ::close(ready[1]);
  RELIEF_MUST(file, ModelFile::open(path));
  EXPECT_EQ(file.stroke_count(), 1U);
}

TEST(ModelFile, ASecondWriterIsToldSoAndReadersAreLetIn) {
  const Folder folder;
  const Model model = ball();
  RELIEF_MUST(first, ModelFile::create(folder / "a.relief", model));
  const auto second = ModelFile::open(folder / "a.relief");
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, Errc::Io);
  EXPECT_NE(second.error().message.find("in use"), std::string::npos) << second.error().message;
  EXPECT_OK(first.commit(stroke(model.head, 1), {}));
  RELIEF_MUST(reader, ModelFile::open(folder / "a.relief", true));
  EXPECT_EQ(reader.stroke_count(), 1U);
  EXPECT_OK(first.commit(stroke(first.model().head, 2), {}));
  EXPECT_EQ(reader.strokes().value_or(std::vector<StrokeRecord>()).size(), 1U)
      << "a reader keeps the moment at which it opened";
  EXPECT_OK(ModelFile::copy(folder / "a.relief", folder / "b.relief"));
  RELIEF_MUST(copied, ModelFile::open(folder / "b.relief", true));
  EXPECT_EQ(copied.stroke_count(), 2U);
}

TEST(ModelFile, AFileInUseIsNotReplaced) {
  const Folder folder;
  RELIEF_MUST(first, ModelFile::create(folder / "a.relief", ball()));
  const auto second = ModelFile::create(folder / "a.relief", ball(1));
  ASSERT_FALSE(second.has_value());
  EXPECT_NE(second.error().message.find("in use"), std::string::npos) << second.error().message;
  EXPECT_OK(first.commit(stroke(first.model().head, 1), {}));
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
}

TEST(ModelFile, CopiesCarryTheWholeHistory) {
  const Folder folder;
  const Model model = ball();
  std::uint64_t latest = 0;
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    EXPECT_OK(file.commit(stroke(model.head, 1), {.label = "one"}));
    EXPECT_OK(file.commit(stroke(file.model().head, 2), {.label = "two"}));
    latest = file.model().head->content_hash();
    EXPECT_OK(file.undo());
  }
  write_file(folder / "b.relief", "something else");
  EXPECT_OK(ModelFile::copy(folder / "a.relief", folder / "b.relief"));
  EXPECT_OK(ModelFile::copy(folder / "a.relief", folder / "a.relief"));
  std::filesystem::create_symlink(folder / "b.relief", folder / "link.relief");
  EXPECT_OK(ModelFile::copy(folder / "a.relief", folder / "link.relief"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.relief"));
  RELIEF_MUST(copy, ModelFile::open(folder / "b.relief"));
  EXPECT_EQ(copy.stroke_count(), 1U);
  EXPECT_OK(copy.redo());
  EXPECT_EQ(copy.model().head->content_hash(), latest);
  RELIEF_MUST(source, ModelFile::open(folder / "a.relief", true));
  EXPECT_EQ(source.stroke_count(), 1U) << "the source stays";

  write_file(folder / "bad.relief", "no model");
  EXPECT_EQ(ModelFile::copy(folder / "bad.relief", folder / "a.relief").error().code, Errc::UnsupportedFormat);
  EXPECT_EQ(ModelFile::copy(folder / "none.relief", folder / "a.relief").error().code, Errc::NotFound);
  EXPECT_OK(ModelFile::open(folder / "a.relief"));
}

TEST(ModelFile, CreatesOverAnything) {
  const Folder folder;
  const Model model = ball();
  write_file(folder / "text.relief", std::string(5000, 'x'));
  write_file(folder / "text.relief-journal", std::string(5000, 'y'));
  write_file(folder / "empty.relief", "");
  write_file(folder / "orphan.relief-journal", read_file(folder / "text.relief"));
  write_file(folder / "orphan.relief-wal", "z");
  write_file(folder / "orphan.relief-shm", "z");
  for (const char* name : {"text.relief", "empty.relief", "orphan.relief"}) {
    EXPECT_OK(ModelFile::create(folder / name, model));
    RELIEF_MUST(file, ModelFile::open(folder / name));
    EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash());
  }
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"empty.relief", "orphan.relief", "text.relief"}));

  EXPECT_EQ(ModelFile::create(folder / "nowhere/a.relief", model).error().code, Errc::Io);
  std::filesystem::create_directory(folder / "dir.relief");
  EXPECT_EQ(ModelFile::create(folder / "dir.relief", model).error().code, Errc::Io);
  EXPECT_TRUE(std::filesystem::is_empty(folder / "dir.relief"));
}

TEST(ModelFile, ReplacingKeepsThePermissions) {
  const Folder folder;
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", ball()).has_value());
  ASSERT_EQ(::chmod((folder / "a.relief").c_str(), 0640), 0);
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", ball(1)).has_value());
  struct stat status{};
  ASSERT_EQ(::stat((folder / "a.relief").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
}

TEST(ModelFile, LeftoversOfKilledRunsGoAwayAndLivingOnesStay) {
  const Folder folder;
  const auto old = folder / "a.relief.0123456789abcdef.tmp", fresh = folder / "a.relief.0123456789abcde0.tmp";
  const auto held = folder / "a.relief.0123456789abcde1.tmp", other = folder / "b.relief.0123456789abcdef.tmp";
  const auto named = folder / "a.relief.notes-by-hand-1.tmp";
  for (const auto& file : {old, fresh, held, other, named}) write_file(file, "x");
  const auto hour_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
  for (const auto& file : {old, held, other, named}) std::filesystem::last_write_time(file, hour_ago);
  std::FILE* holder = std::fopen(held.c_str(), "r");
  ASSERT_EQ(::flock(::fileno(holder), LOCK_EX), 0);
  EXPECT_OK(ModelFile::create(folder / "a.relief", ball(1)));
  std::fclose(holder);
  EXPECT_FALSE(std::filesystem::exists(old));
  for (const auto& file : {fresh, held, other, named}) EXPECT_TRUE(std::filesystem::exists(file)) << file;
}

TEST(ModelFile, AFullDiskLosesNothingThatWasFinished) {
  const Folder folder;
  const Model model = ball(3, 32);
  RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
  EXPECT_OK(file.commit(stroke(model.head, 1), {}));
  const std::uint64_t kept = file.model().head->content_hash();

  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = std::filesystem::file_size(folder / "a.relief") + 5000;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  SnapshotDraft draft(file.model().head);
  draft.add_layer(Layer::Colour, 32, 1.0F);
  for (SlabId s = 0; s < 200; ++s) dab(draft, Layer::Colour, s, static_cast<float>(s) / 200);
  const SnapshotPtr big = draft.finish();
  const Status failed = file.commit(big, {});
  Model painted = model;
  painted.head = big;
  const auto not_made = ModelFile::create(folder / "b.relief", painted);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_DFL);

  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code, Errc::Io);
  EXPECT_NE(failed.error().message.find("a.relief: "), std::string::npos) << failed.error().message;
  ASSERT_FALSE(not_made.has_value());
  EXPECT_EQ(not_made.error().code, Errc::Io);
  EXPECT_NE(not_made.error().message.find("b.relief: "), std::string::npos) << not_made.error().message;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
  EXPECT_EQ(file.model().head->content_hash(), kept);
  EXPECT_EQ(saved_hash(folder / "a.relief"), kept);
  EXPECT_OK(file.commit(big, {}));  // room again
  EXPECT_EQ(saved_hash(folder / "a.relief"), big->content_hash());
}

TEST(ModelFile, APlainModelTakesLittleRoomAndOpens) {
  const Folder folder;
  Model model;
  model.head = Snapshot::make(testing::plane_shell(32, 32));
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", model).has_value());
  EXPECT_LT(std::filesystem::file_size(folder / "a.relief"), model.head->bytes() / 20);
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash());
}

TEST(ModelFile, NamesThatLookLikeUrisAreFiles) {
  const Folder folder;
  const auto back = std::filesystem::current_path();
  std::filesystem::current_path(folder / ".");
  EXPECT_OK(ModelFile::create("file:a?mode=memory", ball(1)));
  EXPECT_OK(ModelFile::open("file:a?mode=memory"));
  std::filesystem::current_path(back);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"file:a?mode=memory"});
}

TEST(ModelFile, StrokesAcrossSlabsOfDifferentNComeBack) {
  const Folder folder;
  Model model = ball(mixed_shell(*sphere_shell(2, 1), 1, 4));
  model.head = testing::with_hole(model.head, [](Vec3d p) { return p.y > 0.8; });
  std::vector<std::uint64_t> hashes = {model.head->content_hash()};
  {
    RELIEF_MUST(file, ModelFile::create(folder / "a.relief", model));
    SnapshotPtr head = model.head;
    for (std::uint64_t k = 1; k <= 6; ++k) {
      head = stroke(head, k);
      hashes.push_back(head->content_hash());
      EXPECT_OK(file.commit(head, {}));
    }
    // A slab whose constrained samples were left as they were is torn.
    SnapshotDraft torn(head);
    const SlabMesh& mesh = head->slab_mesh();
    for (SlabId s = 0; s < mesh.slab_count(); ++s)
      mesh.for_each_constrained(s, [&](GridPoint p, const EdgePlace& place) {
        if (p.j == 0) torn.edit(Layer::Displacement, s).plane()[sample_index(mesh.intervals(s), place.before)] += 0.01F;
      });
    const Status refused = file.commit(torn.finish(), {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Errc::InvalidArgument);
  }
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  EXPECT_TRUE(file.model().head->has(Layer::Void));
  for (std::size_t k = hashes.size(); k-- > 0;) {
    EXPECT_EQ(file.model().head->content_hash(), hashes[k]);
    EXPECT_OK(file.undo());
  }
  EXPECT_OK(file.redo(9));
  EXPECT_EQ(file.model().head->content_hash(), hashes.back());
}

/// Opens a file that an older program wrote, and walks through its history. `hashes`: at stroke 2, 3 and 0.
void expect_opens(const char* golden, const std::array<std::uint64_t, 3>& hashes) {
  const Folder folder;
  std::filesystem::copy_file(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data" / golden, folder / "a.relief");
  RELIEF_MUST(file, ModelFile::open(folder / "a.relief"));
  const auto hash = [&] { return file.model().head->content_hash(); };
  EXPECT_EQ(hash(), hashes[0]) << std::hex << hash();
  EXPECT_EQ(file.model().info.source, "ball \"1\".ply");
  RELIEF_MUST(records, file.strokes());
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(records[0].details, R"({"tool":"carve"})");
  // Stroke 2 painted slab 7 in a colour that 16 bits do not hold exactly.
  for (SlabId s = 0; s < file.model().head->slab_mesh().slab_count(); ++s) {
    const Tile& tile = file.model().head->tile(Layer::Colour, s);
    for (std::size_t k = 0; k < tile.size(); ++k) {
      const bool painted = tile.value(0, k) < 1;
      EXPECT_TRUE(painted || s != 7);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(double(tile.value(c, k)), painted ? 0.125 * (c + 1) : 1, 0.5 / 65535);
    }
  }
  EXPECT_OK(file.redo());
  EXPECT_EQ(hash(), hashes[1]) << std::hex << hash();
  EXPECT_OK(file.undo(3));
  EXPECT_EQ(hash(), hashes[2]) << std::hex << hash();
  EXPECT_OK(file.commit(stroke(file.model().head, 5), {}));
}

TEST(ModelFile, FilesOfFormat1Open) {
  expect_opens("format-1.relief", {0x183799f01a36388U, 0xd87857facf174dd1U, 0x2c22c9950498623dU});
}

/// The first with slabs of different n and holes.
TEST(ModelFile, FilesOfFormat2Open) {
  expect_opens("format-2.relief", {0x8779eecc947d4b97U, 0x280ef61723429632U, 0x235ba4748d3c6d41U});
}

/// The first with colours of 16 bits.
TEST(ModelFile, FilesOfFormat3Open) {
  if (std::getenv("RELIEF_WRITE_GOLDEN") != nullptr) {
    Model model = ball(mixed_shell(*sphere_shell(1, 1), 1, 3));
    model.head = testing::with_hole(model.head, [](Vec3d p) { return p.y > 0.5; });
    RELIEF_MUST(file,
                ModelFile::create(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data/format-3.relief", model));
    EXPECT_OK(file.commit(stroke(model.head, 1), {.label = "carve", .details = R"({"tool":"carve"})"}));
    SnapshotDraft draft(file.model().head);
    draft.add_layer(Layer::Colour, 3, 1.0F);
    dab(draft, Layer::Colour, 7, 0.5F);
    EXPECT_OK(file.commit(draft.finish(), {.label = "paint"}));
    EXPECT_OK(file.commit(stroke(file.model().head, 3), {.label = "undone"}));
    EXPECT_OK(file.undo());
  }
  expect_opens("format-3.relief", {0x8779eecc947d4b97U, 0x280ef61723429632U, 0x235ba4748d3c6d41U});
}

}  // namespace
}  // namespace relief
