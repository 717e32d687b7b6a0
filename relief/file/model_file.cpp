#include <relief/base/assert.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/core/detail.h>
#include <relief/core/plain_cage.h>
#include <relief/core/query.h>
#include <relief/file/database.h>
#include <relief/file/history_check.h>
#include <relief/file/model_file.h>
#include <relief/file/model_rows.h>
#include <relief/file/states.h>
#include <relief/file/tile_codec.h>
#include <relief/verify/verify.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace relief {

namespace {

using detail::CageChange;
using detail::CageState;
using detail::Database;
using detail::FileState;
using detail::kWholeEvery;
using detail::LayerEntry;
using detail::LayerTable;
using detail::Meta;
using detail::Replacement;
using detail::Rows;

constexpr std::size_t kMaxText = std::size_t{1} << 26;

/// Cancelled: what it says means nothing.
std::string certificate_text(const SlabMesh& mesh, const Progress& progress) {
  const PlainCage cage(mesh);
  const verify::Certificate found = verify::check({cage.inner, cage.outer, cage.triangles}, progress);
  std::string text;
  for (std::size_t k = 0; k < found.holds.size(); ++k) {
    if (!found.holds[k]) continue;
    if (!text.empty()) text += ' ';
    text += name(static_cast<verify::Condition>(k));
  }
  return text;
}

/// Returns the verifier on the cage of a file that was read, against what the file says of it.
std::string doubt_about(const SlabMesh& mesh, Mode mode, std::string_view certificate, const Progress& progress) {
  const PlainCage cage(mesh);
  const verify::Certificate found = verify::check({cage.inner, cage.outer, cage.triangles}, progress);
  const auto missed = [&](std::size_t k) {
    const std::string_view condition = name(static_cast<verify::Condition>(k));
    const bool said = certificate.contains(condition) || (mode != Mode::Preview && claims(mode).contains(condition));
    return said && !found.holds[k];
  };
  std::string failing, untested;
  for (std::size_t k = 0; k < verify::kShellConditionCount; ++k) {
    if (!missed(k)) continue;
    std::string& list = found.failure_count[k] > 0 ? failing : untested;
    list += (list.empty() ? "" : ", ") + std::string(name(static_cast<verify::Condition>(k)));
  }
  if (failing.empty() && untested.empty()) return {};
  std::string text = failing.empty() ? "" : "its slabs do not hold " + failing;
  if (!untested.empty()) text += (text.empty() ? "" : ", and ") + untested + " could not be tested";
  for (const verify::Failure& f : found.failures)
    if (missed(static_cast<std::size_t>(f.condition))) return text + ": " + f.what;
  return text;
}

std::size_t present(const LayerTable& layers) {
  return static_cast<std::size_t>(std::ranges::count_if(layers, [](const auto& entry) { return entry.has_value(); }));
}

/// Writes a new model into an empty database that nobody else sees yet.
Status write_model(const Database& database, const Model& model, const Meta& meta, const LayerTable& layers,
                   const Progress& progress) {
  const SlabId page_count = detail::pages_for(model.head->slab_mesh().slab_count());
  const Rows rows(database);
  RELIEF_CHECK(database.run("PRAGMA journal_mode = MEMORY"));
  RELIEF_CHECK(database.run("PRAGMA synchronous = OFF"));
  RELIEF_CHECK(database.run("BEGIN"));
  RELIEF_CHECK(database.write_tables());
  RELIEF_CHECK(rows.write_meta(meta));
  RELIEF_TRY(std::int64_t row_count, rows.cage().write_first(detail::cage_of(*model.head)));
  Steps pages(progress, "save", present(layers) * page_count);
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto& entry = layers[k];
    if (!entry) continue;
    const auto layer = static_cast<Layer>(k);
    RELIEF_CHECK(rows.write_layer(layer, *entry));
    for (SlabId page = 0; page < page_count; ++page) {
      if (!pages.next()) return rows.cancelled();
      RELIEF_CHECK(rows.write_page({layer, page, 0, true}, entry->type, 0, {}, *model.head));
    }
    row_count += 1 + std::int64_t{page_count};
  }
  RELIEF_CHECK(rows.write_stroke({}, row_count));
  return database.run("COMMIT");
}

/// Returns the model's facts and layers as a new file will hold them.
Meta meta_of(const Model& model, FirstState first, const Progress& progress) {
  const SlabMesh& mesh = model.head->slab_mesh();
  return {.info = model.info,
          .fibres = static_cast<std::int64_t>(mesh.root_fibres().size()),
          .slabs = static_cast<std::int64_t>(mesh.roots().size()),
          .certificate = certificate_text(mesh, progress),
          .first_sculpted = first == FirstState::Sculpted};
}
LayerTable layers_of(const Snapshot& head) {
  const CageState cage = detail::cage_of(head);
  LayerTable layers;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto layer = static_cast<Layer>(k);
    if (head.has(layer))
      layers[k] = {.intervals = detail::intervals_entry(layer, cage.grid(layer)), .type = sample_type(layer)};
  }
  return layers;
}

/// Writes one stroke: finds what is another than before, and in which rows it goes.
class StrokeWriter {
 public:
  StrokeWriter(const Database& database, const Meta& meta, const LayerTable& layers, const Snapshot& before,
               const Snapshot& head)
      : database_(database), rows_(database), meta_(meta), layers_(layers), before_(before), head_(head) {}

  /// Looks at the new model. Error: Corrupt, it is not sound.
  Status look() {
    find_changes_of_cage();
    find_changes_of_layers();
    find_changes_of_tiles();
    return check();
  }

  /// Writes it as stroke number() in a transaction that the caller ends.
  Status write(const StrokeRecord& stroke, const Progress& progress) {
    if (meta_.current < meta_.last) RELIEF_CHECK(rows_.drop_strokes_after(meta_.current));
    std::int64_t row_count = 0;
    if (cage_change_) {
      RELIEF_CHECK(upgrade());
      RELIEF_TRY(row_count, write_cage(progress));
    }
    for (const Layer layer : layer_changes_) {
      const auto& entry = layers_[static_cast<std::size_t>(layer)];
      const LayerEntry gone{.stroke = number(), .intervals = detail::kLayerGone};
      RELIEF_CHECK(rows_.write_layer(layer, entry ? *entry : gone));
    }
    Steps pages(progress, "save", changes_.size());
    for (const auto& [key, tiles] : changes_) {
      if (!pages.next()) return rows_.cancelled();
      RELIEF_CHECK(write_page(key.first, key.second, tiles));
    }
    row_count += static_cast<std::int64_t>(changes_.size() + layer_changes_.size());
    const auto named = static_cast<std::uint64_t>(number());
    RELIEF_CHECK(rows_.write_stroke({named, stroke.label, stroke.details, tile_count_}, row_count));
    meta_.current = meta_.last = number_;
    return cage_change_ ? rows_.write_meta(meta_) : rows_.write_place(meta_);
  }

  [[nodiscard]] std::int64_t number() const noexcept { return number_; }
  // After write(): of the file.
  [[nodiscard]] const Meta& meta() const noexcept { return meta_; }
  [[nodiscard]] const LayerTable& layers() const noexcept { return layers_; }

 private:
  template <typename Visit>
  void for_each_layer(Visit&& visit) const {
    for (int k = 0; k < kLayerCount; ++k)
      if (head_.has(static_cast<Layer>(k))) visit(static_cast<Layer>(k));
  }
  [[nodiscard]] bool is_fresh(Layer layer) const noexcept { return fresh_[static_cast<std::size_t>(layer)]; }

  void find_changes_of_cage() {
    // Cages of one number have the same grids of displacement.
    same_cage_ = before_.slab_mesh().number() == head_.slab_mesh().number();
    const auto same_grid = [&](Layer layer, SlabId s) {
      return head_.intervals(layer, s) ==
             (before_.has(layer) ? before_.intervals(layer, s) : head_.intervals(layer, 0));
    };
    if (same_cage_)
      for_each_change(before_, head_, [&](Layer layer, SlabId s) { same_cage_ = same_cage_ && same_grid(layer, s); });
    if (same_cage_) {
      for_each_layer([&](Layer layer) { fresh_[static_cast<std::size_t>(layer)] = !before_.has(layer); });
      return;
    }
    was_ = detail::cage_of(before_);
    now_ = detail::cage_of(head_);
    const CageChange change = detail::change_between(was_, now_);
    moved_ = change == CageChange::Anew || !detail::same_places(was_, now_);
    bool grids_change = false;
    for_each_layer([&](Layer layer) {
      const detail::Grid &old = was_.grid(layer), &grid = now_.grid(layer);
      // One that is as coarse everywhere, and was that otherwise, is made again.
      const bool is_another = !has_own_intervals(layer) && before_.has(layer) && was_.cuts == now_.cuts &&
                              old != grid && detail::is_uniform(old) && detail::is_uniform(grid);
      const bool fresh = !before_.has(layer) || is_another || change == CageChange::Anew;
      fresh_[static_cast<std::size_t>(layer)] = fresh && layer != Layer::Displacement;
      grids_change = grids_change || (fresh ? !has_own_intervals(layer) && !detail::is_uniform(grid) : old != grid);
      if (fresh_[static_cast<std::size_t>(layer)] && !has_own_intervals(layer))
        was_.grids[static_cast<std::size_t>(layer)].clear();
    });
    if (change != CageChange::Step || moved_ || was_.cuts != now_.cuts || grids_change) cage_change_ = change;
  }

  void find_changes_of_layers() {
    for (std::size_t k = 0; k < layers_.size(); ++k) {
      const auto layer = static_cast<Layer>(k);
      if (!head_.has(layer) ? !layers_[k] : !fresh_[k]) continue;
      layer_changes_.push_back(layer);
      layers_[k].reset();
      if (!head_.has(layer)) continue;
      const std::int64_t intervals = same_cage_ ? (has_own_intervals(layer) ? kOwnIntervals : head_.intervals(layer, 0))
                                                : detail::intervals_entry(layer, now_.grid(layer));
      layers_[k] = {.stroke = number_, .intervals = intervals, .type = detail::type_in_file(layer, meta_)};
    }
  }

  void find_changes_of_tiles() {
    if (!cage_change_) {
      for_each_change(before_, head_, [&](Layer layer, SlabId s) {
        if (!is_fresh(layer) && head_.tile(layer, s).same_values(before_.tile(layer, s))) return;
        note_change(layer, s);
        ++tile_count_;
        changed_.emplace_back(layer, s);
      });
      return;
    }
    const SlabId count = head_.slab_mesh().slab_count(), old_count = before_.slab_mesh().slab_count();
    if (cage_change_ != CageChange::Anew)
      parts_ = parts_after(old_count, std::span(now_.cuts).subspan(was_.cuts.size()));
    for_each_layer([&](Layer layer) {
      for (SlabId s = 0; s < count; ++s) {
        const bool was_there = before_.has(layer) && s < old_count;
        if (was_there && head_.shared_tile(layer, s) == before_.shared_tile(layer, s) && !is_made_anew(layer) &&
            parts_[s].level == 0)
          continue;
        changed_.emplace_back(layer, s);
        if (!was_there || !head_.tile(layer, s).same_values(before_.tile(layer, s))) ++tile_count_;
        if (is_made_anew(layer) || !head_.tile(layer, s).same_values(*expected(layer, s))) note_change(layer, s);
      }
    });
  }
  void note_change(Layer layer, SlabId s) {
    changes_[{layer, s / kTilesPerPage}] |= std::uint64_t{1} << (s % kTilesPerPage);
  }
  [[nodiscard]] bool is_made_anew(Layer layer) const noexcept {
    return is_fresh(layer) || cage_change_ == CageChange::Anew;
  }
  /// Returns the tile that a slab has without a row, of a layer that there was.
  const TilePtr& expected(Layer layer, SlabId s) {
    if (!cage_change_) return before_.shared_tile(layer, s);
    const RootPlace& part = parts_[s];
    const int n = head_.intervals(layer, s);
    const TilePtr& from = before_.shared_tile(layer, part.root);
    if (part.level == 0 && from->intervals() == n) return from;
    TilePtr& tile = expected_[{layer, s}];
    if (!tile) {
      tile = detail::carried_tile(from, layer, part, n);
      carried_ += detail::tile_bytes(layer, n, sample_type(layer));
    }
    return tile;
  }

  /// Of another cage also what lies beside what changed must fit it.
  Status check() const {
    std::set<std::pair<Layer, SlabId>> all(changed_.begin(), changed_.end());
    if (cage_change_)
      for (const auto& [layer, s] : changed_)
        for (int edge = 0; edge < 3; ++edge)
          head_.slab_mesh().for_each_across(s, edge, [&](SlabId other) { all.emplace(layer, other); });
    for (const auto& [layer, s] : all) RELIEF_CHECK(validate(head_, layer, s));
    return {};
  }

  Status upgrade() {
    if (meta_.format == kFormatVersion) return {};
    meta_ = meta_.upgraded();
    return database_.run("PRAGMA user_version = " + std::to_string(kFormatVersion));
  }

  Result<std::int64_t> write_cage(const Progress& progress) {
    RELIEF_TRY(const std::int64_t last_whole, rows_.cage().last_whole(meta_.current));
    RELIEF_TRY(const auto steps, rows_.cage().changes(last_whole, meta_.current));
    const auto told = rows_.cage().certificate(meta_.current, meta_);
    const Progress quiet{.report = {}, .cancel = progress.cancel};
    const std::string certificate = moved_ || !told ? certificate_text(head_.slab_mesh(), quiet) : *told;
    if (quiet.cancelled()) return rows_.cancelled();
    const bool whole = cage_change_ != CageChange::Step || meta_.float_colours ||
                       static_cast<std::int64_t>(steps.size()) >= kWholeEvery;
    if (whole) {
      RELIEF_CHECK(find_pages_to_write(last_whole));
      return rows_.cage().write_whole(number_, now_, certificate);
    }
    RELIEF_TRY(std::int64_t rows, rows_.cage().write_step(number_, was_, now_, certificate, carried_));
    for (const Layer layer : layer_changes_) {
      const auto& entry = layers_[static_cast<std::size_t>(layer)];
      if (!entry || entry->intervals != detail::kEachItsOwn) continue;
      RELIEF_CHECK(rows_.cage().write_grid(number_, layer, now_.grid(layer)));
      ++rows;
    }
    return rows;
  }
  /// Returns where the cage is reported as a whole, pages are written whole if a slab of theirs has got another grid
  /// since it was told before: from here on they are read by their own rows.
  Status find_pages_to_write(std::int64_t last_whole) {
    RELIEF_TRY(const CageState then, rows_.cage().read_whole(last_whole, meta_));
    for_each_layer([&](Layer layer) {
      const auto& entry = *layers_[static_cast<std::size_t>(layer)];
      const detail::Grid &old = then.grid(layer), &now = now_.grid(layer);
      const auto as_then = [&](SlabId s) {
        if (is_made_anew(layer) || s >= then.slab_count() || then.levels[s] != now_.levels[s]) return false;
        if (!has_own_intervals(layer) && entry.stroke > last_whole) return false;
        return old.empty() ? entry.intervals == now[s] : old[s] == now[s];
      };
      for (SlabId s = 0; s < now_.slab_count(); ++s)
        if (!as_then(s)) {
          whole_.emplace(layer, s / kTilesPerPage);
          note_change(layer, s);
        }
    });
    return {};
  }

  Status write_page(Layer layer, SlabId page, std::uint64_t tiles) {
    const LayerEntry& entry = *layers_[static_cast<std::size_t>(layer)];
    // What the file has as another type was rounded when it was read: a difference would not lead back to it.
    bool whole = is_made_anew(layer) || whole_.contains({layer, page}) || entry.type != sample_type(layer);
    if (!whole) {
      RELIEF_TRY(const std::int64_t earlier, rows_.changes_since_whole(layer, page));
      whole = earlier >= kWholeEvery;
    }
    return rows_.write_page(
        {layer, page, tiles, whole}, entry.type, number_, [&](SlabId s) -> const Tile& { return *expected(layer, s); },
        head_);
  }

  const Database& database_;
  Rows rows_;
  Meta meta_;
  LayerTable layers_;
  const Snapshot &before_, &head_;
  std::int64_t number_ = meta_.current + 1;

  bool same_cage_ = true;
  std::optional<CageChange> cage_change_;
  bool moved_ = false;                     ///< roots have other fibres
  CageState was_, now_;                    ///< where they are not the same
  std::vector<RootPlace> parts_;           ///< the old slabs that the slabs are parts of
  std::array<bool, kLayerCount> fresh_{};  ///< layers that the stroke brings
  std::vector<Layer> layer_changes_;       ///< these, and those that go
  std::vector<std::pair<Layer, SlabId>> changed_;
  std::map<std::pair<Layer, SlabId>, std::uint64_t> changes_;  ///< tiles to be written, by page
  std::set<std::pair<Layer, SlabId>> whole_;                   ///< pages
  std::map<std::pair<Layer, SlabId>, TilePtr> expected_;       ///< that were carried
  std::size_t carried_ = 0;
  std::uint64_t tile_count_ = 0;
};

}  // namespace

struct ModelFile::State {
  Database database;
  bool read_only = false;
  Meta meta{};
  LayerTable layers{};
  Model model{};
  std::uint32_t changes = 0;  ///< the file's change counter as long as only we have written it
  std::int64_t incomplete = std::numeric_limits<std::int64_t>::max();  ///< the first stroke that lacks rows

  /// Makes every commit durable, and keeps other writers out from now on; readers are let in except while we write.
  [[nodiscard]] Status lock() {
    RELIEF_CHECK(database.run("PRAGMA journal_mode = DELETE"));
    RELIEF_CHECK(database.run("PRAGMA synchronous = EXTRA"));
    RELIEF_CHECK(
        database.run("PRAGMA secure_delete = ON"));  // rows of dropped strokes are not found again by salvage()
    RELIEF_CHECK(database.run("BEGIN IMMEDIATE"));
    changes = database.change_counter();
    return {};
  }

  /// That nobody else has written. Asked under a lock, at the begin of whatever relies on the rows: another writer may
  /// come between a commit of ours and the next lock, or while a file dialog of this process has dropped the lock by
  /// looking into the file.
  [[nodiscard]] Status check_unchanged() const {
    if (database.change_counter() == changes) return {};
    database.roll_back();
    return database.failure(Errc::Io, "was changed by another program: open it again");
  }

  /// Runs `change`, which writes something, in a transaction of its own; what it wrote is on disk on return, or nothing
  /// of it is left. Others are kept out before it and after it.
  template <typename Change>
  [[nodiscard]] Status transaction(Change&& change) {
    RELIEF_CHECK(check_writable());
    if (!database.in_transaction()) RELIEF_CHECK(database.run("BEGIN IMMEDIATE"));
    RELIEF_CHECK(check_unchanged());
    Status done = change();
    if (done) done = database.run("COMMIT");
    if (done) ++changes;
    database.roll_back();
    if (!database.run("BEGIN IMMEDIATE")) database.roll_back();  // another was quicker: the next transaction says so
    return done;
  }

  /// Runs `read` on the rows as they were when the file was opened, or after our last commit.
  template <typename Read>
  [[nodiscard]] auto reading(Read&& read) const -> decltype(read()) {
    const bool alone = database.in_transaction();
    if (!alone) RELIEF_CHECK(database.begin_reading());
    RELIEF_CHECK(check_unchanged());
    auto found = read();
    if (!alone) database.roll_back();
    return found;
  }
  [[nodiscard]] Status check_writable() const {
    return read_only ? Status(database.failure(Errc::Io, "was opened for reading only")) : Status();
  }
  /// That no stroke up to this one lacks rows.
  [[nodiscard]] Status check_complete(std::int64_t stroke) const {
    if (stroke < incomplete) return {};
    return database.damaged("changes of stroke " + std::to_string(incomplete) + " are missing");
  }

  [[nodiscard]] Status read(const Progress& progress);
  [[nodiscard]] Result<FileState> state_at(std::int64_t stroke, const FileState& near, std::int64_t near_stroke,
                                           const Progress& progress) const;
  [[nodiscard]] std::unexpected<Error> cannot_go(std::int64_t stroke, const Error& why, const Progress& progress) const;
  [[nodiscard]] Result<std::uint64_t> move_to(std::int64_t stroke, const Progress& progress);
};

ModelFile::ModelFile(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
ModelFile::ModelFile(ModelFile&&) noexcept = default;
ModelFile& ModelFile::operator=(ModelFile&&) noexcept = default;
ModelFile::~ModelFile() = default;

Result<ModelFile> ModelFile::create(const std::filesystem::path& file, const Model& model, const Progress& progress,
                                    FirstState first) {
  RELIEF_ASSERT(model.head != nullptr);
  const auto refuse = [&](const Error& why) {
    std::string text = "'";
    text.append(printable(file.string())).append("' is not written: ").append(why.message);
    return fail(why.code, std::move(text));
  };
  constexpr double kCheckedShare = 0.2;  // of the time
  if (const Status sound = validate(*model.head, part_of(progress, "save", 0, kCheckedShare)); !sound) {
    const Errc code = sound.error().code == Errc::Cancelled ? Errc::Cancelled : Errc::InvalidArgument;
    return refuse({code, sound.error().message});
  }
  if (!std::isfinite(model.info.source_diagonal) || model.info.source_diagonal < 0)
    return refuse({Errc::InvalidArgument, "the source's diagonal is not a length"});

  std::optional<State> made;
  {
    RELIEF_TRY(Replacement replacement, Replacement::make(file, detail::model_kind()));
    {
      const Progress saving = part_of(progress, "save", kCheckedShare, 1);
      RELIEF_TRY(ModelFile unsaved, make_unsaved(replacement.file(), file, model, first, saving));
      // What is not in its place yet can still be given up.
      if (progress.cancelled()) return unsaved.state_->database.cancelled();
      made = State{.database = {}, .meta = unsaved.state_->meta, .layers = unsaved.state_->layers, .model = model};
    }
    RELIEF_CHECK(replacement.replace_target());
  }
  RELIEF_TRY(made->database, Database::open(file, Database::Access::Write, detail::model_kind()));
  RELIEF_CHECK(made->lock());
  return ModelFile(std::make_unique<State>(*std::move(made)));
}

Result<ModelFile> ModelFile::make_unsaved(const std::filesystem::path& place, const std::filesystem::path& named,
                                          const Model& model, FirstState first, const Progress& progress) {
  RELIEF_TRY(Database database, Database::open(place, Database::Access::Write, detail::model_kind(), named));
  constexpr double kProvenShare = 0.3;  // of the time
  auto state = std::make_unique<State>(State{.database = std::move(database),
                                             .meta = meta_of(model, first, part_of(progress, "save", 0, kProvenShare)),
                                             .layers = layers_of(*model.head),
                                             .model = model});
  if (progress.cancelled()) return state->database.cancelled();
  const Progress writing = part_of(progress, "save", kProvenShare, 1);
  RELIEF_CHECK(write_model(state->database, model, state->meta, state->layers, writing));
  state->changes = state->database.change_counter();
  return ModelFile(std::move(state));
}

Result<ModelFile> ModelFile::open(const std::filesystem::path& file, bool read_only, const Progress& progress) {
  RELIEF_TRY(Database database,
             Database::open(file, read_only ? Database::Access::Read : Database::Access::Write, detail::model_kind()));
  auto state = std::make_unique<State>(State{.database = std::move(database), .read_only = read_only});
  if (Status read = state->read(progress); !read) {
    if (read.error().code == Errc::Corrupt)
      read.error().message += "; relief info MODEL --salvage -o OUT.relief writes what is whole";
    return std::unexpected(std::move(read).error());
  }
  return ModelFile(std::move(state));
}

Status ModelFile::State::read(const Progress& progress) {
  const Database::Cancellable cancellable(database, progress);
  const Rows rows(database);
  progress("open", 0);
  constexpr double kTablesShare = 0.3;    // of the time
  RELIEF_CHECK(database.check_format());  // before anything is changed in what may be somebody else's database
  if (read_only) {
    RELIEF_CHECK(database.begin_reading());
    changes = database.change_counter();
  } else {
    RELIEF_CHECK(lock());
  }
  RELIEF_CHECK(database.check_tables(part_of(progress, "open", 0, kTablesShare)));
  RELIEF_TRY(meta, rows.read_meta());
  RELIEF_TRY(incomplete, rows.first_incomplete(meta));
  RELIEF_CHECK(check_complete(meta.current));
  const Progress reading = part_of(progress, "open", kTablesShare, 1);
  RELIEF_TRY(FileState found, detail::read_state(rows, meta, meta.current, nullptr, reading));
  model = {.info = meta.info, .head = std::move(found.snapshot)};
  layers = found.layers;
  if (read_only) database.roll_back();
  return {};
}

Status ModelFile::copy(const std::filesystem::path& from, const std::filesystem::path& to, const Progress& progress) {
  RELIEF_TRY(const Database source, Database::open(from, Database::Access::Read, detail::model_kind()));
  {
    const Database::Cancellable cancellable(source, progress);
    RELIEF_CHECK(source.check_format());
    RELIEF_CHECK(source.check_tables(part_of(progress, "copy", 0, 0.5)));
  }
  std::error_code code;
  if (std::filesystem::equivalent(from, to, code)) return {};
  RELIEF_TRY(Replacement replacement, Replacement::make(to, detail::model_kind()));
  {
    RELIEF_TRY(const Database database,
               Database::open(replacement.file(), Database::Access::Write, detail::model_kind(), to));
    RELIEF_CHECK(database.run("PRAGMA journal_mode = MEMORY"));
    RELIEF_CHECK(database.run("PRAGMA synchronous = OFF"));
    RELIEF_CHECK(database.copy_from(source, part_of(progress, "copy", 0.5, 1)));
    // What is not in its place yet can still be given up.
    if (progress.cancelled()) return database.cancelled();
  }
  return replacement.replace_target();
}

const Model& ModelFile::model() const noexcept { return state_->model; }
std::string ModelFile::doubt(const Progress& progress) const {
  const State& state = *state_;
  const auto certificate =
      state.reading([&] { return Rows(state.database).cage().certificate(state.meta.current, state.meta); });
  return doubt_about(state.model.head->slab_mesh(), state.meta.info.mode, certificate.value_or(state.meta.certificate),
                     progress);
}
std::uint64_t ModelFile::stroke_count() const noexcept { return static_cast<std::uint64_t>(state_->meta.current); }
std::uint64_t ModelFile::redo_count() const noexcept {
  return static_cast<std::uint64_t>(state_->meta.last - state_->meta.current);
}

Result<std::vector<StrokeRecord>> ModelFile::strokes() const {
  return Rows(state_->database).read_strokes(state_->meta.last);
}

Result<std::vector<DamagedStrokes>> ModelFile::damage(const Progress& progress) const {
  const State& state = *state_;
  const Database::Cancellable cancellable(state.database, progress);
  RELIEF_TRY(const detail::HistoryCheck check, state.reading([&] {
    return detail::check_history(state.database, state.database, true, state.meta.last, progress);
  }));
  std::vector<DamagedStrokes> found;
  for (std::uint64_t k = 0; k < check.readable.size(); ++k) {
    if (check.readable[k]) continue;
    if (found.empty() || found.back().last + 1 != k) found.push_back({k, k});
    found.back().last = k;
  }
  return found;
}

Status ModelFile::commit(SnapshotPtr head, const StrokeRecord& stroke, const Progress& progress) {
  RELIEF_ASSERT(head != nullptr);
  State& state = *state_;
  const auto refuse = [&](const std::string& why) {
    return state.database.failure(Errc::InvalidArgument, "keeps its last stroke: " + why);
  };
  if (stroke.label.size() > kMaxText || stroke.details.size() > kMaxText)
    return refuse("the stroke's text is too long");
  StrokeWriter writer(state.database, state.meta, state.layers, *state.model.head, *head);
  if (const Status sound = writer.look(); !sound) return refuse(sound.error().message);
  RELIEF_CHECK(state.transaction([&] { return writer.write(stroke, progress); }));
  state.meta = writer.meta();
  state.layers = writer.layers();
  state.model.head = std::move(head);
  state.incomplete = std::max(state.incomplete, writer.number() + 1);
  return {};
}

Result<SnapshotPtr> ModelFile::at(std::uint64_t stroke, const SnapshotPtr& near, std::uint64_t near_stroke,
                                  const Progress& progress) const {
  RELIEF_ASSERT(near != nullptr);
  const State& state = *state_;
  const auto last = static_cast<std::uint64_t>(state.meta.last);
  if (std::max(stroke, near_stroke) > last)
    return state.database.failure(Errc::NotFound, "has no stroke " + std::to_string(std::max(stroke, near_stroke)));
  const Database::Cancellable cancellable(state.database, progress);
  return state.reading([&]() -> Result<SnapshotPtr> {
    FileState from{near, state.layers};
    if (near_stroke != stroke_count()) {
      RELIEF_TRY(from.layers, Rows(state.database).read_layers(static_cast<std::int64_t>(near_stroke), state.meta));
    }
    RELIEF_TRY(FileState found, state.state_at(static_cast<std::int64_t>(stroke), from,
                                               static_cast<std::int64_t>(near_stroke), progress));
    return std::move(found.snapshot);
  });
}

Result<SnapshotPtr> ModelFile::at(std::uint64_t stroke, const Progress& progress) const {
  return at(stroke, model().head, stroke_count(), progress);
}

Result<SnapshotPtr> ModelFile::as_made(std::uint64_t stroke, const Progress& progress) const {
  const State& state = *state_;
  if (stroke > static_cast<std::uint64_t>(state.meta.last))
    return state.database.failure(Errc::NotFound, "has no stroke " + std::to_string(stroke));
  const auto read = [&]() -> Result<SnapshotPtr> {
    RELIEF_TRY(const std::int64_t made, state.reading([&] {
      return Rows(state.database).cage().slabs_made_at(static_cast<std::int64_t>(stroke), state.meta);
    }));
    if (made == 0 && first_state() == FirstState::Sculpted) return SnapshotPtr();
    return at(static_cast<std::uint64_t>(made), progress);
  };
  Result<SnapshotPtr> found = read();
  if (!found && found.error().code == Errc::Corrupt) return SnapshotPtr();
  return found;
}

FirstState ModelFile::first_state() const noexcept {
  return state_->meta.first_sculpted ? FirstState::Sculpted : FirstState::AsMade;
}

Result<std::uint64_t> ModelFile::undo(std::uint64_t strokes, const Progress& progress) {
  const auto steps = static_cast<std::int64_t>(std::min(strokes, stroke_count()));
  return state_->move_to(state_->meta.current - steps, progress);
}

Result<std::uint64_t> ModelFile::redo(std::uint64_t strokes, const Progress& progress) {
  const auto steps = static_cast<std::int64_t>(std::min(strokes, redo_count()));
  return state_->move_to(state_->meta.current + steps, progress);
}

std::string name_of(const DamagedStrokes& strokes) {
  const auto& [first, last] = strokes;
  if (last == 0) return "the model before its first stroke";
  if (first == 0) return "all up to stroke " + std::to_string(last);
  if (first == last) return "stroke " + std::to_string(first);
  return "strokes " + std::to_string(first) + " to " + std::to_string(last);
}

std::string to_string(const DamagedStrokes& strokes) {
  return name_of(strokes) + (strokes.first > 0 && strokes.first < strokes.last ? " are damaged" : " is damaged");
}

Status ModelFile::go_to(std::uint64_t stroke, SnapshotPtr state_there) {
  RELIEF_ASSERT(state_there != nullptr);
  State& state = *state_;
  RELIEF_CHECK(state.check_writable());
  if (stroke > static_cast<std::uint64_t>(state.meta.last))
    return state.database.failure(Errc::NotFound, "has no stroke " + std::to_string(stroke));
  Meta meta = state.meta;
  meta.current = static_cast<std::int64_t>(stroke);
  LayerTable layers;
  const auto look = [&]() -> Status {
    const Rows rows(state.database);
    RELIEF_CHECK(state.check_complete(meta.current));
    RELIEF_TRY(layers, rows.read_layers(meta.current, meta));
    RELIEF_TRY(const bool fits, detail::has_shape_of(rows, meta, meta.current, *state_there));
    if (!fits)
      return state.database.failure(Errc::InvalidArgument,
                                    "keeps its place: the model given is not that of stroke " + std::to_string(stroke));
    return {};
  };
  if (meta.current == state.meta.current) {
    RELIEF_CHECK(state.reading(look));
  } else {
    const auto move = [&]() -> Status {
      RELIEF_CHECK(look());
      return Rows(state.database).write_place(meta);
    };
    RELIEF_CHECK(state.transaction(move));
  }
  state.meta = std::move(meta);
  state.layers = layers;
  state.model.head = std::move(state_there);
  return {};
}

Result<FileState> ModelFile::State::state_at(std::int64_t stroke, const FileState& near, std::int64_t near_stroke,
                                             const Progress& progress) const {
  if (stroke == near_stroke) return near;
  RELIEF_CHECK(check_complete(stroke));
  return detail::move_state(Rows(database), meta, stroke, near, near_stroke, progress);
}

/// Says how far undo or redo can go where it cannot go to a stroke.
std::unexpected<Error> ModelFile::State::cannot_go(std::int64_t stroke, const Error& why,
                                                   const Progress& progress) const {
  const auto check = detail::check_history(database, database, true, meta.last, progress);
  if (!check || check->readable[static_cast<std::size_t>(stroke)]) return std::unexpected(why);
  const std::int64_t step = stroke < meta.current ? -1 : 1;
  const auto is = [&](bool readable, std::int64_t k) {
    return k >= 0 && k <= meta.last && check->readable[static_cast<std::size_t>(k)] == readable;
  };
  std::int64_t stop = meta.current;
  while (is(true, stop + step)) stop += step;
  std::int64_t lost = stop + step;
  while (is(false, lost + step)) lost += step;
  const auto [first, last] = std::minmax({stop + step, lost});
  return database.failure(
      Errc::Corrupt, "stays at stroke " + std::to_string(meta.current) + ": " +
                         to_string({static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last)}) + ", and " +
                         (step < 0 ? "undo" : "redo") + " stops at stroke " + std::to_string(stop));
}

Result<std::uint64_t> ModelFile::State::move_to(std::int64_t stroke, const Progress& progress) {
  RELIEF_CHECK(check_writable());
  if (stroke == meta.current) return 0;
  const Database::Cancellable cancellable(database, progress);
  Meta moved_meta = meta;
  moved_meta.current = stroke;
  FileState there;
  const auto write = [&]() -> Status {
    auto found = state_at(stroke, {model.head, layers}, meta.current, progress);
    if (!found)
      return found.error().code == Errc::Corrupt ? cannot_go(stroke, found.error(), progress)
                                                 : std::unexpected(found.error());
    there = *std::move(found);
    return Rows(database).write_place(moved_meta);
  };
  RELIEF_CHECK(transaction(write));
  const std::int64_t steps = stroke - meta.current;
  meta = std::move(moved_meta);
  layers = there.layers;
  model.head = std::move(there.snapshot);
  return static_cast<std::uint64_t>(steps < 0 ? -steps : steps);
}

}  // namespace relief
