// The states that a document can go back and forth to, within a budget of bytes.
#pragma once

#include <relief/core/snapshot.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relief::detail {

/// States first() .. last(), one after each stroke, numbered as in the file; one of them is the position. What does not
/// fit into the budget is let go of: where a file keeps it, its number stays, and read() of the file brings it back.
/// One thread.
class History {
 public:
  struct State {
    SnapshotPtr snapshot{};    ///< null: only the file has it
    std::string label{};       ///< of the stroke that led to it
    std::string text{};        ///< of that stroke, as long as no file has it
    std::uint64_t serial = 0;  ///< another one for each state that there ever was
    bool saved = false;        ///< the file has it
    bool new_slabs = false;    ///< its slabs were made here: no tool has worked on them
  };

  /// `labels` of all strokes, those that were undone at the end; `head` is the state after `position` of them. The
  /// others are in the file, which also knows who made their slabs. Without a file the head's are new.
  History(SnapshotPtr head, const std::vector<std::string>& labels, std::size_t position, bool has_file);

  [[nodiscard]] std::size_t first() const noexcept { return first_; }
  [[nodiscard]] std::size_t last() const noexcept { return first_ + states_.size() - 1; }
  [[nodiscard]] std::size_t position() const noexcept { return position_; }
  [[nodiscard]] const State& at(std::size_t number) const { return states_[number - first_]; }
  /// Of the strokes that undo and redo would take next; empty where there is none.
  [[nodiscard]] std::string_view undo_label() const noexcept;
  [[nodiscard]] std::string_view redo_label() const noexcept;

  /// The states after the position go; `state` comes there, and is the position. Returns its number.
  std::size_t push(SnapshotPtr snapshot, std::string label, std::string text, bool new_slabs = false);
  /// Makes `number` the position; `snapshot` is its state.
  void move_to(std::size_t number, SnapshotPtr snapshot);
  /// The file has the state of that serial number. Returns its number, if it is still one of these.
  std::optional<std::size_t> saved(std::uint64_t serial);
  /// The file has all states up to that serial number.
  void saved_up_to(std::uint64_t serial);
  /// Forgets the states before and after these two.
  void keep_only(std::size_t from, std::size_t to);
  /// Returns the held state nearest to a number that the file has, too; null where there is none.
  [[nodiscard]] std::pair<std::size_t, SnapshotPtr> nearest_saved(std::size_t number) const;
  /// Returns the state that made the slabs of the position, if it is held; null where it is not, or only the file knows
  /// which one it is.
  [[nodiscard]] SnapshotPtr held_as_made() const;
  /// Returns the last state up to the position that the file has, if there is one.
  [[nodiscard]] std::optional<std::size_t> last_saved() const;
  /// Returns the range of states, the position among them, that are held without a gap: first and last number.
  [[nodiscard]] std::pair<std::size_t, std::size_t> held_around() const;

  /// States that no file has.
  [[nodiscard]] std::uint64_t unsaved() const;
  /// Bytes of tiles and cages that only the history holds: all but those of the position; and of texts.
  [[nodiscard]] std::size_t bytes() const noexcept { return model_bytes_ + text_bytes_; }
  [[nodiscard]] std::size_t held() const noexcept { return held_.size(); }
  /// Releases the states farthest from the position until the others fit. With a file: of those that it has. Without:
  /// they are gone, and so are the numbers beyond them; returns how many strokes can no more be undone or redone.
  std::size_t fit(std::size_t budget, bool has_file);

 private:
  [[nodiscard]] State& state(std::size_t number) { return states_[number - first_]; }
  void hold(std::size_t number, SnapshotPtr snapshot);
  void let_go(std::size_t number);
  void drop_after(std::size_t number);
  void mark_saved(State& state);
  void count();

  std::deque<State> states_;
  std::size_t first_ = 0, position_ = 0;
  /// Of two held states in a row: bytes of tiles and cages that the first has and the second has not, and the other way
  /// round; at the number of the first.
  struct Difference {
    std::size_t older = 0, newer = 0;
  };
  [[nodiscard]] Difference difference(std::size_t from, std::size_t to) const;
  std::set<std::size_t> held_;
  std::map<std::size_t, Difference> differences_;
  std::size_t model_bytes_ = 0, text_bytes_ = 0;
  std::uint64_t serial_ = 0;
};

}  // namespace relief::detail
