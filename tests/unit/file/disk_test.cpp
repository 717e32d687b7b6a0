// The disk loses its power or fails at any call: the file is at the stroke before or after, and the error is told.
#include <sqlite3.h>
#include <support/disk.h>
#include <unit/file/file_support.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <map>
#include <optional>

namespace relief {
namespace {

using testing::ball;
using testing::dab;
using testing::Disk;
using testing::Folder;
using testing::read_file;
using testing::stroke;
using testing::write_file;

/// What the model in a folder is after a power loss.
std::uint64_t hash_after(const Disk::Image& image, const char* name) {
  const Folder folder;
  for (const auto& [file, bytes] : image) write_file(folder / file.c_str(), bytes);
  return testing::saved_hash(folder / name);
}

TEST(PowerLoss, WhatHasReturnedIsOnTheDisk) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Model model = ball(2, 4);
  const Disk disk((folder / "a").parent_path());
  RELIEF_MUST(file, ModelFile::create(path, model));
  EXPECT_EQ(hash_after(disk.durable(), "a.relief"), model.head->content_hash());
  SnapshotPtr head = model.head;
  for (std::uint64_t k = 1; k <= 8; ++k) {
    head = stroke(head, k);
    EXPECT_OK(file.commit(head, {.label = "k"}));
    EXPECT_EQ(hash_after(disk.durable(), "a.relief"), head->content_hash()) << k;
    EXPECT_EQ(disk.durable().count("a.relief-journal"), 0U) << "the journal would take the stroke back";
  }
  EXPECT_OK(file.undo(3));
  EXPECT_EQ(hash_after(disk.durable(), "a.relief"), file.model().head->content_hash());
  EXPECT_OK(file.redo());
  EXPECT_EQ(hash_after(disk.durable(), "a.relief"), file.model().head->content_hash());
  const std::uint64_t last = file.model().head->content_hash();
  EXPECT_OK(ModelFile::copy(path, folder / "b.relief"));
  EXPECT_EQ(hash_after(disk.durable(), "b.relief"), last);
  const Model other = ball(1, 5);
  EXPECT_OK(ModelFile::create(folder / "b.relief", other));
  EXPECT_EQ(hash_after(disk.durable(), "b.relief"), other.head->content_hash());
}

TEST(PowerLoss, BetweenTwoSyncsTheFileIsAtOneStrokeOrTheNext) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Model model = ball(2, 4), other = ball(1, 5);
  ASSERT_TRUE(ModelFile::create(path, model).has_value());
  Disk disk((folder / "a").parent_path());
  const auto expect = [&](std::uint64_t before, std::uint64_t after) {
    bool seen_before = false, seen_after = false;
    EXPECT_GT(disk.moments().size(), 1U);
    for (const Disk::Image& image : disk.moments()) {
      const std::uint64_t hash = hash_after(image, "a.relief");
      EXPECT_TRUE(hash == before || hash == after);
      EXPECT_FALSE(seen_after && hash != after) << "what was there is gone again";
      seen_before = seen_before || hash == before;
      seen_after = seen_after || hash == after;
    }
    EXPECT_TRUE(seen_before);
    EXPECT_TRUE(seen_after);
    disk.forget_moments();
  };
  const std::uint64_t first = model.head->content_hash();
  {
    RELIEF_MUST(file, ModelFile::open(path));
    disk.forget_moments();
    const SnapshotPtr head = stroke(model.head, 1);
    EXPECT_OK(file.commit(head, {}));
    expect(first, head->content_hash());
    EXPECT_OK(file.undo());
    expect(head->content_hash(), first);
    EXPECT_OK(file.redo());
    expect(first, head->content_hash());
    EXPECT_OK(file.undo());
  }
  disk.forget_moments();
  EXPECT_OK(ModelFile::create(path, other));
  expect(first, other.head->content_hash());
}

/// Runs a change of a.relief (at `before`) again and again, each time failing at a later call, until none fails.
/// Returns the number of calls. `work` makes the change on an open model, or by itself where it is given none.
struct Change {
  const Model& before;
  std::uint64_t after;
  bool opens;
  std::function<std::optional<Error>(const Folder& folder, ModelFile* file)> work;
};

int fail_at_every_call(const Change& change, int error, Disk::Failure failure) {
  const std::uint64_t before = change.before.head->content_hash();
  for (int call = 1; call < 1000; ++call) {
    const Folder folder;
    const auto path = folder / "a.relief";
    EXPECT_OK(ModelFile::create(path, change.before));
    bool failed = false;
    {
      std::optional<ModelFile> file;
      if (change.opens) {
        auto opened = ModelFile::open(path);
        EXPECT_OK(opened);
        file = std::move(*opened);
      }
      Disk disk((folder / "a").parent_path());
      disk.fail_at(call, error, failure);
      const auto told = change.work(folder, file ? &*file : nullptr);
      failed = disk.failed();
      disk.work_again();
      if (told) {
        EXPECT_TRUE(failed) << told->message;
        EXPECT_EQ(told->code, Errc::Io) << told->message;
        EXPECT_NE(told->message.find("a.relief"), std::string::npos) << told->message;
        EXPECT_EQ(told->message.find('\n'), std::string::npos) << told->message;
      }
      // The disk works again: the model goes on where it says that it is.
      if (file) {
        EXPECT_EQ(file->model().head->content_hash(), told ? before : change.after) << call;
        const SnapshotPtr next = stroke(file->model().head, 50);
        if (const Status more = file->commit(next, {}); more) {
          EXPECT_EQ(testing::saved_hash(path), next->content_hash()) << call;
          if (!failed) return call - 1;
          continue;
        }
      }
      file.reset();
      const std::uint64_t hash = testing::saved_hash(path);
      EXPECT_TRUE(hash == change.after || (told && hash == before)) << "at call " << call;
    }
    // Of a disk that fails for good nothing can be removed either.
    for (const std::string& name : folder.names())
      EXPECT_TRUE(failure == Disk::Failure::FromThenOn || name == "a.relief") << name << " at call " << call;
    if (!failed) return call - 1;
    if (::testing::Test::HasFailure()) return call;
  }
  return 1000;
}

std::optional<Error> told(const auto& result) { return result ? std::nullopt : std::optional(result.error()); }

TEST(FailingDisk, AtEveryCallTheFileIsAtTheStrokeBeforeOrAfterAndTheErrorIsTold) {
  const Model model = ball(2, 4), other = ball(1, 5);
  const SnapshotPtr head = stroke(model.head, 1);
  SnapshotDraft draft(head);
  draft.add_layer(Layer::Colour, 9, 1.0F);
  dab(draft, Layer::Colour, 7, 0.5F);
  const SnapshotPtr painted = draft.finish();
  const std::uint64_t first = model.head->content_hash();
  const Folder elsewhere;
  ASSERT_TRUE(ModelFile::create(elsewhere / "source.relief", other).has_value());
  const std::map<std::string, Change> changes = {
      {"commit",
       {model, head->content_hash(), true,
        [&](const Folder&, ModelFile* file) { return told(file->commit(head, {})); }}},
      {"commit with a layer",
       {model, painted->content_hash(), true,
        [&](const Folder&, ModelFile* file) { return told(file->commit(painted, {})); }}},
      {"create",
       {model, other.head->content_hash(), false,
        [&](const Folder& folder, ModelFile*) { return told(ModelFile::create(folder / "a.relief", other)); }}},
      {"copy",
       {model, other.head->content_hash(), false,
        [&](const Folder& folder, ModelFile*) {
          return told(ModelFile::copy(elsewhere / "source.relief", folder / "a.relief"));
        }}},
      {"open",
       {model, first, false,
        [&](const Folder& folder, ModelFile*) { return told(ModelFile::open(folder / "a.relief")); }}},
  };
  for (const auto& [what, change] : changes)
    for (const int error : {EIO, ENOSPC})
      for (const auto failure : {Disk::Failure::Once, Disk::Failure::FromThenOn}) {
        SCOPED_TRACE(what + ", " + std::strerror(error) + (failure == Disk::Failure::Once ? ", once" : ", for good"));
        const int calls = fail_at_every_call(change, error, failure);
        EXPECT_GE(calls, what == "open" ? 1 : 8);
        if (HasFailure()) return;
      }
}

TEST(FailingDisk, AnUndoIsDoneOrNot) {
  const Model model = ball(2, 4);
  const SnapshotPtr head = stroke(model.head, 1);
  const std::uint64_t first = model.head->content_hash(), second = head->content_hash();
  for (int call = 1;; ++call) {
    ASSERT_LT(call, 1000);
    const Folder folder;
    const auto path = folder / "a.relief";
    RELIEF_MUST(file, ModelFile::create(path, model));
    ASSERT_TRUE(file.commit(head, {}).has_value());
    Disk disk((folder / "a").parent_path());
    disk.fail_at(call, EIO);
    const auto undone = file.undo();
    const bool failed = disk.failed();
    disk.work_again();
    EXPECT_TRUE(undone || failed);
    EXPECT_EQ(file.model().head->content_hash(), undone ? first : second);
    const std::uint64_t hash = testing::saved_hash(path);
    EXPECT_TRUE(hash == first || (!undone && hash == second)) << call;
    if (!failed) {
      EXPECT_GT(call, 8);
      return;
    }
  }
}

/// However many strokes there were, a page is read from few rows.
TEST(ModelFile, APageIsReadFromNoMoreThan65RowsAfterAThousandStrokes) {
  const Folder folder;
  const auto path = folder / "a.relief";
  {
    const Model model = ball(1, 1);
    RELIEF_MUST(file, ModelFile::create(path, model));
    SnapshotPtr head = model.head;
    for (std::uint64_t k = 1; k <= 1000; ++k) {
      head = stroke(head, k);
      ASSERT_TRUE(file.commit(head, {}).has_value());
    }
  }
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  sqlite3_stmt* rows = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(handle, "SELECT whole FROM pages WHERE page = 0 ORDER BY stroke", -1, &rows, nullptr),
            SQLITE_OK);
  int total = 0, since_whole = 0, most = 0;
  for (; sqlite3_step(rows) == SQLITE_ROW; ++total) {
    since_whole = sqlite3_column_int(rows, 0) == 1 ? 1 : since_whole + 1;
    most = std::max(most, since_whole);
  }
  sqlite3_finalize(rows);
  sqlite3_close(handle);
  EXPECT_EQ(total, 1001);
  EXPECT_EQ(most, 65);
}

}  // namespace
}  // namespace relief
