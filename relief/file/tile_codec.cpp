#include <relief/file/tile_codec.h>

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>

namespace relief::detail {

static_assert(std::endian::native == std::endian::little, "blobs are little-endian; add a swap here");

namespace {
constexpr int kLevel = 3;
/// Header of a zstd frame that decoders skip: magic number, then the count of bytes that follow.
constexpr std::uint32_t kSkippable = 0x184D2A50U;
}  // namespace

std::vector<std::byte> pack(std::span<const std::byte> raw, std::size_t width, std::size_t expansion) {
  const std::size_t count = raw.size() / width;
  auto shuffled = std::make_unique_for_overwrite<std::byte[]>(raw.size());
  for (std::size_t rank = 0; rank < width; ++rank)
    for (std::size_t k = 0; k < count; ++k) shuffled[rank * count + k] = raw[k * width + rank];

  // Of this room only what it comes to is touched.
  const std::size_t most = ZSTD_compressBound(raw.size());
  const auto room = std::make_unique_for_overwrite<std::byte[]>(most);
  const std::size_t size = ZSTD_compress(room.get(), most, shuffled.get(), width * count, kLevel);
  shuffled.reset();
  std::vector<std::byte> blob;
  // Only lack of memory makes it fail; unpack() refuses the empty blob.
  if (ZSTD_isError(size) == 0U) blob.assign(room.get(), room.get() + size);
  if (!may_hold(blob, raw.size(), expansion)) pad(blob, raw.size() / expansion);
  return blob;
}

void pad(std::vector<std::byte>& blob, std::size_t size) {
  if (blob.size() >= size) return;
  const std::array<std::uint32_t, 2> header = {kSkippable, static_cast<std::uint32_t>(size - blob.size())};
  const auto bytes = std::as_bytes(std::span(header));
  blob.insert(blob.end(), bytes.begin(), bytes.end());
  blob.resize(blob.size() + header[1]);
}

std::optional<std::size_t> unpacked_size(std::span<const std::byte> blob) noexcept {
  const auto size = ZSTD_getFrameContentSize(blob.data(), blob.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) return std::nullopt;
  return static_cast<std::size_t>(size);
}

bool unpack(std::span<const std::byte> blob, std::size_t width, std::span<std::byte> raw) {
  if (!may_hold(blob, raw.size()) || ZSTD_getFrameContentSize(blob.data(), blob.size()) != raw.size()) return false;
  std::vector<std::byte> shuffled(raw.size());
  if (ZSTD_decompress(shuffled.data(), shuffled.size(), blob.data(), blob.size()) != raw.size()) return false;
  const std::size_t count = raw.size() / width;
  for (std::size_t rank = 0; rank < width; ++rank)
    for (std::size_t k = 0; k < count; ++k) raw[k * width + rank] = shuffled[rank * count + k];
  return true;
}

void copy_samples(const Tile& tile, SampleType type, std::span<std::byte> to) noexcept {
  for (int c = 0; c < tile.channel_count(); ++c) {
    const std::span<std::byte> plane = to.subspan(static_cast<std::size_t>(c) * tile.size() * bytes(type));
    if (type != tile.type())
      for (std::size_t k = 0; k < tile.size(); ++k) {
        const float value = tile.value(c, k);
        std::memcpy(plane.data() + k * sizeof value, &value, sizeof value);
      }
    else if (type == SampleType::U16)
      std::memcpy(plane.data(), tile.plane16(c), tile.size() * bytes(type));
    else
      std::memcpy(plane.data(), tile.plane(c), tile.size() * bytes(type));
  }
  tile.rest();
}

TilePtr tile_from(std::span<const std::byte> samples, SampleType type, Layer layer, int intervals) {
  auto tile = std::make_shared<Tile>(layer, intervals, 0.0F);
  for (int c = 0; c < tile->channel_count(); ++c) {
    const std::span<const std::byte> plane = samples.subspan(static_cast<std::size_t>(c) * tile->size() * bytes(type));
    if (type != tile->type())
      for (std::size_t k = 0; k < tile->size(); ++k) {
        float value = 0;
        std::memcpy(&value, plane.data() + k * sizeof value, sizeof value);
        if (!(value >= range(layer).low && value <= range(layer).high)) return nullptr;
        tile->set(c, k, value);
      }
    else if (type == SampleType::U16)
      std::memcpy(tile->plane16(c), plane.data(), tile->size() * bytes(type));
    else
      std::memcpy(tile->plane(c), plane.data(), tile->size() * bytes(type));
  }
  return tile;
}

void exclusive_or(std::span<std::byte> to, std::span<const std::byte> by) noexcept {
  std::transform(to.begin(), to.end(), by.begin(), to.begin(), [](std::byte a, std::byte b) { return a ^ b; });
}

}  // namespace relief::detail
