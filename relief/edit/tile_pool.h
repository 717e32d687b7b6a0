// Tiles that come back, so that a stroke need not ask the system for each.
#pragma once

#include <relief/core/snapshot.h>

#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

namespace relief::detail {

/// Tiles that no snapshot holds any more, for the next dab: a stroke makes and drops many of few sizes, and giving
/// their memory back to the system each time costs more than the tools. A tile comes back on whatever thread releases
/// the last snapshot that held it, which is never the servo's.
class TilePool : public std::enable_shared_from_this<TilePool> {
 public:
  /// Returns a tile of the same shape, with any values.
  std::shared_ptr<Tile> take(const Tile& like) {
    std::unique_ptr<Tile> tile;
    {
      const std::lock_guard lock(mutex_);
      if (auto& idle = idle_[shape(like)]; !idle.empty()) {
        tile = std::move(idle.back());
        idle.pop_back();
        idle_bytes_ -= tile->bytes();
      }
    }
    if (!tile) tile = std::make_unique<Tile>(like);
    return {tile.release(), [pool = shared_from_this()](Tile* done) { pool->give(std::unique_ptr<Tile>(done)); }};
  }
  std::shared_ptr<Tile> copy(const Tile& tile) {
    auto made = take(tile);
    made->copy_values(tile);
    return made;
  }

  /// Frees the tiles that wait.
  void clear() {
    const std::lock_guard lock(mutex_);
    idle_.clear();
    idle_bytes_ = 0;
  }

 private:
  static constexpr std::size_t kMaxIdleBytes = std::size_t{16} << 20U;

  void give(std::unique_ptr<Tile> tile) {
    const std::lock_guard lock(mutex_);
    if (idle_bytes_ + tile->bytes() > kMaxIdleBytes) return;
    idle_bytes_ += tile->bytes();
    idle_[shape(*tile)].push_back(std::move(tile));
  }
  using Shape = std::tuple<int, int, SampleType>;
  static Shape shape(const Tile& tile) noexcept { return {tile.intervals(), tile.channel_count(), tile.type()}; }

  std::mutex mutex_;
  std::map<Shape, std::vector<std::unique_ptr<Tile>>> idle_;
  std::size_t idle_bytes_ = 0;
};

}  // namespace relief::detail
