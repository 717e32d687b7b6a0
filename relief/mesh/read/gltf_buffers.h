// The bytes of a glTF file: its buffers, views of these (packed ones too), and the typed values that lie in views.
#pragma once

#include <relief/mesh/read/gltf_json.h>
#include <relief/mesh/read/source.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relief::detail {

/// glTF's numbers for the types of components.
enum ComponentType : std::uint16_t {
  kByte = 5120,
  kUnsignedByte = 5121,
  kShort = 5122,
  kUnsignedShort = 5123,
  kUnsignedInt = 5125,
  kFloat = 5126
};

/// Typed values in memory that the GltfBuffers they are from keeps.
struct Accessor {
  const char* data = nullptr;  ///< null: all zero
  std::size_t count = 0;
  std::size_t stride = 0;
  std::uint16_t type = kFloat;
  std::size_t components = 0;
  bool normalised = false;

  [[nodiscard]] double value(std::size_t item, std::size_t component) const noexcept {
    if (data == nullptr) return 0.0;
    const char* at = data + item * stride;
    switch (type) {
      case kByte: {
        const auto v = load_le<std::int8_t>(at + component);
        return normalised ? std::max(v / 127.0, -1.0) : v;
      }
      case kUnsignedByte:
        return load_le<std::uint8_t>(at + component) * (normalised ? 1.0 / 255.0 : 1.0);
      case kShort: {
        const auto v = load_le<std::int16_t>(at + 2 * component);
        return normalised ? std::max(v / 32767.0, -1.0) : v;
      }
      case kUnsignedShort:
        return load_le<std::uint16_t>(at + 2 * component) * (normalised ? 1.0 / 65535.0 : 1.0);
      case kUnsignedInt:
        return load_le<std::uint32_t>(at + 4 * component);
      default:
        return double{load_le<float>(at + 4 * component)};
    }
  }
  [[nodiscard]] Vec3d vec3(std::size_t item) const noexcept { return {value(item, 0), value(item, 1), value(item, 2)}; }
};

inline constexpr const char* kMeshoptCompression = "EXT_meshopt_compression";

/// Returns the bytes of data:...;base64,... Nothing when it is no such thing.
[[nodiscard]] std::optional<std::string> decode_data_uri(std::string_view uri);
/// Returns a path with its %20 and the like replaced.
[[nodiscard]] std::string decode_percent(std::string_view uri);

class GltfBuffers {
 public:
  GltfBuffers(const Source& source, const Json& root) noexcept : source_(source), root_(root) {}

  /// Loads all buffers: `binary_chunk` of a GLB, what stands in the JSON, files beside it.
  [[nodiscard]] Status open(std::optional<std::string_view> binary_chunk);
  /// Of the file and all its buffers.
  [[nodiscard]] std::size_t total_bytes() const noexcept;
  /// Returns the bytes of a view, unpacked where it is packed.
  [[nodiscard]] Result<std::string_view> view(std::optional<std::uint64_t> index);
  /// Corrupt where an accessor is missing, malformed or reaches beyond its view.
  [[nodiscard]] Result<Accessor> accessor(std::optional<std::uint64_t> index);
  /// Returns whether an accessor's whole numbers mean 0..1 or -1..1.
  [[nodiscard]] bool normalised(std::optional<std::uint64_t> index) const;

 private:
  /// `count` items of `item` bytes in a view from `offset`.
  struct Run {
    std::optional<std::uint64_t> view;
    std::uint64_t offset, count;
    std::size_t item;
  };
  [[nodiscard]] Result<const char*> in_view(const Run& run, std::size_t& stride);
  [[nodiscard]] Result<Accessor> read_accessor(const Json& json);
  [[nodiscard]] Status apply_sparse(const Json& sparse, std::size_t item, Accessor& out);
  [[nodiscard]] Result<std::string_view> part_of_buffer(const Json& place) const;
  [[nodiscard]] Result<std::string_view> unpack(std::uint64_t index, const Json& compression);

  const Source& source_;
  const Json& root_;
  std::vector<std::string> loaded_;
  std::vector<FileBytes> files_;
  std::vector<std::string_view> buffers_;
  std::map<std::uint64_t, std::string> unpacked_;  ///< by view
  std::size_t unpacked_bytes_ = 0;
  std::map<std::uint64_t, Accessor> accessors_;
  std::vector<std::unique_ptr<std::string>> dense_;  ///< of accessors that were sparse
};

}  // namespace relief::detail
