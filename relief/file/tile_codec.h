// How samples and the cage become blobs: bytes of equal rank side by side, then zstd.
#pragma once

#include <relief/core/snapshot.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// No blob stands for more than so many times its own bytes, so what a file can ask for is bounded by its size. The
/// cage gets less, because what is built from it takes ten times its bytes.
inline constexpr std::size_t kMaxExpansion = 256;
inline constexpr std::size_t kMaxCageExpansion = 16;

/// `raw` holds values of `width` bytes. Blobs that would expand by more than `expansion` end in an empty (skippable)
/// frame.
[[nodiscard]] std::vector<std::byte> pack(std::span<const std::byte> raw, std::size_t width,
                                          std::size_t expansion = kMaxExpansion);
/// Makes a blob at least so long by an empty frame behind it.
void pad(std::vector<std::byte>& blob, std::size_t size);
/// Returns how many bytes a blob says that it stands for; nothing where it does not say.
[[nodiscard]] std::optional<std::size_t> unpacked_size(std::span<const std::byte> blob) noexcept;
/// Returns whether `blob` may stand for `bytes` bytes; asked before memory is taken for them.
[[nodiscard]] constexpr bool may_hold(std::span<const std::byte> blob, std::size_t bytes,
                                      std::size_t expansion = kMaxExpansion) noexcept {
  return bytes / expansion <= blob.size();
}
/// Fills `raw`; false when the blob does not stand for exactly as many bytes.
[[nodiscard]] bool unpack(std::span<const std::byte> blob, std::size_t width, std::span<std::byte> raw);

/// Bytes of a tile's samples as the file has them: plane after plane, without padding, each of that type.
[[nodiscard]] constexpr std::size_t tile_bytes(Layer layer, int intervals, SampleType type) noexcept {
  return sample_count(intervals) * static_cast<std::size_t>(channels(layer)) * bytes(type);
}
void copy_samples(const Tile& tile, SampleType type, std::span<std::byte> to) noexcept;
/// Null where the samples are of another type than the layer's and beyond its range.
[[nodiscard]] TilePtr tile_from(std::span<const std::byte> samples, SampleType type, Layer layer, int intervals);
/// to ^= by.
void exclusive_or(std::span<std::byte> to, std::span<const std::byte> by) noexcept;

}  // namespace relief::detail
