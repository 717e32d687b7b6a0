#include <relief/base/assert.h>
#include <relief/session/history.h>

#include <algorithm>
#include <iterator>

namespace relief::detail {

namespace {

std::size_t bytes_of(const Tile& tile) {
  return tile.bytes() + Tile::kBeside + (tile.bounds_known() ? tile.bounds().bytes() : 0);
}

/// Of the tiles in `to`, and of its cage, that `from` has not.
std::size_t new_bytes(const Snapshot& from, const Snapshot& to) {
  std::size_t sum = to.slab_mesh().bytes_beside(&from.slab_mesh());
  const Tile* before = nullptr;  // many slabs may have the same tile, as when a layer is made
  for_each_change(from, to, [&](Layer layer, SlabId s) {
    const Tile& tile = to.tile(layer, s);
    if (&tile != before) sum += bytes_of(tile);
    before = &tile;
  });
  return sum;
}

}  // namespace

History::History(SnapshotPtr head, const std::vector<std::string>& labels, std::size_t position, bool has_file)
    : position_(position) {
  RELIEF_ASSERT(position <= labels.size());
  states_.push_back({.serial = ++serial_, .saved = true, .new_slabs = !has_file});
  for (const std::string& label : labels) states_.push_back({.label = label, .serial = ++serial_, .saved = true});
  hold(position, std::move(head));
}

std::string_view History::undo_label() const noexcept {
  return position_ > first_ ? std::string_view(at(position_).label) : std::string_view();
}
std::string_view History::redo_label() const noexcept {
  return position_ < last() ? std::string_view(at(position_ + 1).label) : std::string_view();
}

std::size_t History::push(SnapshotPtr snapshot, std::string label, std::string text, bool new_slabs) {
  drop_after(position_);
  text_bytes_ += text.size();
  states_.push_back({.label = std::move(label), .text = std::move(text), .serial = ++serial_, .new_slabs = new_slabs});
  position_ = last();
  hold(position_, std::move(snapshot));
  return position_;
}

void History::move_to(std::size_t number, SnapshotPtr snapshot) {
  RELIEF_ASSERT(number >= first_ && number <= last());
  position_ = number;
  hold(number, std::move(snapshot));
}

std::optional<std::size_t> History::saved(std::uint64_t serial) {
  // Serial numbers rise with the numbers of the states.
  const auto found = std::ranges::lower_bound(states_, serial, {}, &State::serial);
  if (found == states_.end() || found->serial != serial) return std::nullopt;
  mark_saved(*found);
  return first_ + static_cast<std::size_t>(found - states_.begin());
}

void History::saved_up_to(std::uint64_t serial) {
  for (State& one : states_)
    if (one.serial <= serial) mark_saved(one);
}

std::uint64_t History::unsaved() const {
  return static_cast<std::uint64_t>(std::ranges::count(states_, false, &State::saved));
}

void History::mark_saved(State& state) {
  state.saved = true;
  text_bytes_ -= state.text.size();
  state.text = {};
}

void History::keep_only(std::size_t from, std::size_t to) {
  RELIEF_ASSERT(from >= first_ && from <= position_ && position_ <= to && to <= last());
  drop_after(to);
  while (first_ < from) {
    let_go(first_);
    text_bytes_ -= states_.front().text.size();
    states_.pop_front();
    ++first_;
  }
  count();
}

std::pair<std::size_t, SnapshotPtr> History::nearest_saved(std::size_t number) const {
  std::pair<std::size_t, SnapshotPtr> nearest;
  std::size_t least = ~std::size_t{0};
  for (const std::size_t k : held_) {
    const std::size_t distance = k > number ? k - number : number - k;
    if (!at(k).saved || distance >= least) continue;
    least = distance;
    nearest = {k, at(k).snapshot};
  }
  return nearest;
}

SnapshotPtr History::held_as_made() const {
  for (std::size_t k = position_ + 1; k-- > first_;)
    if (at(k).new_slabs) return at(k).snapshot;
  return nullptr;
}

std::optional<std::size_t> History::last_saved() const {
  for (std::size_t k = position_ + 1; k-- > first_;)
    if (at(k).saved) return k;
  return std::nullopt;
}

std::pair<std::size_t, std::size_t> History::held_around() const {
  std::size_t low = position_, high = position_;
  while (low > first_ && at(low - 1).snapshot) --low;
  while (high < last() && at(high + 1).snapshot) ++high;
  return {low, high};
}

std::size_t History::fit(std::size_t budget, bool has_file) {
  std::size_t dropped = 0;
  const auto may_go = [&](std::size_t k) { return k != position_ && (!has_file || at(k).saved); };
  while (bytes() > budget) {
    const std::size_t low = *held_.begin(), high = *held_.rbegin();
    const bool low_first = position_ - low >= high - position_;
    const std::size_t first = low_first ? low : high, second = low_first ? high : low;
    if (!may_go(first) && !may_go(second)) break;
    const std::size_t victim = may_go(first) ? first : second;
    let_go(victim);
    count();
    if (has_file) continue;
    const std::size_t from = *held_.begin(), to = *held_.rbegin();
    dropped += (from - first_) + (last() - to);
    keep_only(from, to);
  }
  return dropped;
}

History::Difference History::difference(std::size_t from, std::size_t to) const {
  const Snapshot &a = *at(from).snapshot, &b = *at(to).snapshot;
  return {.older = new_bytes(b, a), .newer = new_bytes(a, b)};
}

void History::hold(std::size_t number, SnapshotPtr snapshot) {
  State& here = state(number);
  here.snapshot = std::move(snapshot);
  const auto place = held_.insert(number).first;
  if (place != held_.begin()) differences_[*std::prev(place)] = difference(*std::prev(place), number);
  if (const auto next = std::next(place); next != held_.end()) differences_[number] = difference(number, *next);
  count();
}

void History::let_go(std::size_t number) {
  const auto place = held_.find(number);
  if (place == held_.end()) return;
  state(number).snapshot.reset();
  differences_.erase(number);
  if (place != held_.begin()) {
    const std::size_t before = *std::prev(place);
    differences_.erase(before);
    if (const auto next = std::next(place); next != held_.end()) differences_[before] = difference(before, *next);
  }
  held_.erase(place);
}

void History::drop_after(std::size_t number) {
  while (last() > number) {
    let_go(last());
    text_bytes_ -= states_.back().text.size();
    states_.pop_back();
  }
}

void History::count() {
  model_bytes_ = 0;
  for (const auto& [number, difference] : differences_)
    model_bytes_ += number < position_ ? difference.older : difference.newer;
}

}  // namespace relief::detail
