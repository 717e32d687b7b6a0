#include <relief/base/try.h>
#include <relief/mesh/read/gltf_buffers.h>
#include <relief/mesh/read/images.h>

#if RELIEF_WITH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace relief::detail {
namespace {

std::optional<std::string> decode_base64(std::string_view code) {
  std::string out;
  out.reserve(code.size() / 4 * 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : code) {
    std::uint32_t value = 0;
    if (c >= 'A' && c <= 'Z') {
      value = static_cast<std::uint32_t>(c - 'A');
    } else if (c >= 'a' && c <= 'z') {
      value = static_cast<std::uint32_t>(c - 'a') + 26;
    } else if (c >= '0' && c <= '9') {
      value = static_cast<std::uint32_t>(c - '0') + 52;
    } else if (c == '+' || c == '-') {
      value = 62;
    } else if (c == '/' || c == '_') {
      value = 63;
    } else if (c == '=') {
      break;
    } else {
      return std::nullopt;
    }
    bits = (bits << 6U) | value;
    held += 6;
    if (held >= 8) {
      held -= 8;
      out += static_cast<char>((bits >> static_cast<unsigned>(held)) & 0xffU);
    }
  }
  return out;
}

/// Bytes of a component of each ComponentType; 0 where glTF has none.
std::size_t component_size(std::uint64_t type) noexcept {
  constexpr std::array<std::size_t, 7> kSizes = {1, 1, 2, 2, 0, 4, 4};
  return type < kByte || type > kFloat ? 0 : kSizes[type - kByte];
}

std::size_t component_count(std::string_view shape) noexcept {
  if (shape.starts_with("VEC") && shape.size() == 4 && shape[3] >= '2' && shape[3] <= '4')
    return static_cast<std::size_t>(shape[3] - '0');
  return shape == "SCALAR" ? 1 : shape == "MAT4" ? 16 : 0;
}

bool is_normalised(const Json& accessor) {
  const Json* flag = member(accessor, "normalized");
  return flag != nullptr && flag->is_boolean() && flag->get<bool>();
}

/// Holds what EXT_meshopt_compression says of a view.
struct Packing {
  std::string mode, filter;
  std::size_t count, stride;
};

#if RELIEF_WITH_MESHOPTIMIZER
/// False when the data are damaged. `out` has count * stride bytes. The decoder asserts what is checked here.
bool unpack_meshopt(const Packing& packing, std::string_view packed, char* out) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(packed.data());
  const std::size_t count = packing.count, stride = packing.stride;
  const bool index_size = stride == 2 || stride == 4;
  if (packing.mode == "TRIANGLES")
    return index_size && count % 3 == 0 && meshopt_decodeIndexBuffer(out, count, stride, bytes, packed.size()) == 0;
  if (packing.mode == "INDICES")
    return index_size && meshopt_decodeIndexSequence(out, count, stride, bytes, packed.size()) == 0;
  if (packing.mode != "ATTRIBUTES" || stride == 0 || stride > 256 || stride % 4 != 0) return false;
  if (meshopt_decodeVertexBuffer(out, count, stride, bytes, packed.size()) != 0) return false;
  if (packing.filter == "OCTAHEDRAL") {
    if (stride != 4 && stride != 8) return false;
    meshopt_decodeFilterOct(out, count, stride);
  } else if (packing.filter == "QUATERNION") {
    if (stride != 8) return false;
    meshopt_decodeFilterQuat(out, count, stride);
  } else if (packing.filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(out, count, stride);
  }
  return true;
}
#endif

}  // namespace

std::optional<std::string> decode_data_uri(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const std::size_t comma = uri.find(kMark);
  if (comma == std::string_view::npos) return std::nullopt;
  return decode_base64(uri.substr(comma + kMark.size()));
}

std::string decode_percent(std::string_view uri) {
  std::string out;
  for (std::size_t k = 0; k < uri.size(); ++k) {
    unsigned value = 0;
    if (uri[k] == '%' && k + 2 < uri.size() &&
        std::from_chars(uri.data() + k + 1, uri.data() + k + 3, value, 16).ptr == uri.data() + k + 3) {
      out += static_cast<char>(value);
      k += 2;
    } else {
      out += uri[k];
    }
  }
  return out;
}

Status GltfBuffers::open(std::optional<std::string_view> binary_chunk) {
  const Json* list = member(root_, "buffers");
  if (list == nullptr || !list->is_array()) return {};
  loaded_.reserve(list->size());
  files_.reserve(list->size());
  for (std::size_t k = 0; k < list->size(); ++k) {
    const Json& buffer = (*list)[k];
    const std::string uri = text(buffer, "uri");
    if (uri.empty()) {
      buffers_.push_back(k == 0 && binary_chunk ? *binary_chunk : std::string_view());
      // Only programs that cannot unpack views need what stands there.
      const Json* extensions = member(buffer, "extensions");
      if (extensions != nullptr && member(*extensions, kMeshoptCompression) != nullptr) continue;
    } else if (uri.starts_with("data:")) {
      std::optional<std::string> bytes = decode_data_uri(uri);
      if (!bytes) return source_.corrupt("buffer " + std::to_string(k) + " is no base64");
      loaded_.push_back(*std::move(bytes));
      buffers_.emplace_back(loaded_.back());
    } else {
      const auto file = beside(source_, decode_percent(uri));
      if (!file) {
        return source_.error(Errc::UnsupportedFormat,
                             "buffer '" + printable(uri, 60) + "' does not lie beside the file");
      }
      RELIEF_TRY(FileBytes bytes, source_.read_other(*file));
      files_.push_back(std::move(bytes));
      buffers_.push_back(files_.back().view());
    }
    const auto declared = whole(buffer, "byteLength");
    if (!declared || *declared > buffers_.back().size())
      return source_.corrupt("buffer " + std::to_string(k) + " is shorter than it declares");
  }
  return {};
}

std::size_t GltfBuffers::total_bytes() const noexcept {
  std::size_t sum = source_.bytes.size();
  for (const std::string_view buffer : buffers_) sum += buffer.size();
  return sum;
}

Result<std::string_view> GltfBuffers::part_of_buffer(const Json& place) const {
  const auto buffer = whole(place, "buffer");
  const auto start = whole(place, "byteOffset", 0);
  const auto length = whole(place, "byteLength");
  const bool fits = buffer && *buffer < buffers_.size() && start && length && *start <= buffers_[*buffer].size() &&
                    *length <= buffers_[*buffer].size() - *start;
  if (!fits) return source_.corrupt("a buffer view does not fit its buffer");
  return buffers_[*buffer].substr(static_cast<std::size_t>(*start), static_cast<std::size_t>(*length));
}

Result<std::string_view> GltfBuffers::view(std::optional<std::uint64_t> index) {
  const Json* view = element(root_, "bufferViews", index);
  if (view == nullptr) return source_.corrupt("a buffer view is missing");
  const Json* extensions = member(*view, "extensions");
  const Json* compression = extensions != nullptr ? member(*extensions, kMeshoptCompression) : nullptr;
  return compression != nullptr ? unpack(*index, *compression) : part_of_buffer(*view);
}

Result<std::string_view> GltfBuffers::unpack(std::uint64_t index, const Json& compression) {
  if (const auto known = unpacked_.find(index); known != unpacked_.end()) return std::string_view(known->second);
#if RELIEF_WITH_MESHOPTIMIZER
  const auto damaged = [&] {
    return source_.corrupt("the packed data of buffer view " + std::to_string(index) + " are damaged");
  };
  RELIEF_TRY(const std::string_view packed, part_of_buffer(compression));
  const auto count = whole(compression, "count"), stride = whole(compression, "byteStride");
  if (!count || !stride || *stride == 0 || *stride > 256) return damaged();
  // A run of 16 equal bytes takes two bits, so that honest data grow 64-fold at most.
  const std::size_t most = (std::size_t{1} << 20U) + 64 * total_bytes();
  if (*count > (most - unpacked_bytes_) / *stride) return damaged();
  const Packing packing{text(compression, "mode"), text(compression, "filter"), static_cast<std::size_t>(*count),
                        static_cast<std::size_t>(*stride)};
  std::string out(packing.count * packing.stride, '\0');
  if (!unpack_meshopt(packing, packed, out.data())) return damaged();
  unpacked_bytes_ += out.size();
  return std::string_view(unpacked_.emplace(index, std::move(out)).first->second);
#else
  static_cast<void>(compression);
  return source_.error(Errc::UnsupportedFormat, "is packed by " + std::string(kMeshoptCompression) +
                                                    ", which this build leaves out; export it without compression");
#endif
}

Result<const char*> GltfBuffers::in_view(const Run& run, std::size_t& stride) {
  RELIEF_TRY(const std::string_view bytes, view(run.view));
  const auto step = whole(*element(root_, "bufferViews", run.view), "byteStride", 0);
  const auto bad = [&] { return source_.corrupt("values reach beyond their buffer view"); };
  if (!step || *step > 65535 || run.offset > bytes.size()) return bad();
  stride = *step == 0 ? run.item : static_cast<std::size_t>(*step);
  const std::uint64_t room = bytes.size() - run.offset;
  if (run.count != 0 && (run.item > room || (run.count - 1) > (room - run.item) / stride)) return bad();
  return bytes.data() + run.offset;
}

Result<Accessor> GltfBuffers::accessor(std::optional<std::uint64_t> index) {
  const Json* json = element(root_, "accessors", index);
  if (json == nullptr)
    return source_.corrupt("accessor " + (index ? std::to_string(*index) : std::string("?")) + " is missing");
  if (const auto known = accessors_.find(*index); known != accessors_.end()) return known->second;
  auto made = read_accessor(*json);
  if (!made) {
    // What failed below says what; the place is here.
    const std::string& why = made.error().message;
    const std::string_view what = std::string_view(why).substr(std::min(why.size(), source_.name.size() + 2));
    return source_.error(made.error().code, "accessor " + std::to_string(*index) + ": " + std::string(what));
  }
  return accessors_.emplace(*index, *made).first->second;
}

bool GltfBuffers::normalised(std::optional<std::uint64_t> index) const {
  const Json* json = element(root_, "accessors", index);
  return json != nullptr && is_normalised(*json);
}

Result<Accessor> GltfBuffers::read_accessor(const Json& json) {
  Accessor out;
  const auto type = whole(json, "componentType");
  const auto count = whole(json, "count");
  const auto offset = whole(json, "byteOffset", 0);
  out.components = component_count(text(json, "type"));
  const std::size_t item = type ? component_size(*type) * out.components : 0;
  if (!count || !offset || item == 0) return source_.corrupt("its type or its count is malformed");
  out.type = static_cast<std::uint16_t>(*type);
  out.count = static_cast<std::size_t>(*count);
  out.stride = item;
  out.normalised = is_normalised(json);
  if (member(json, "bufferView") != nullptr) {
    RELIEF_TRY(out.data, in_view({whole(json, "bufferView"), *offset, *count, item}, out.stride));
  } else if (*count > source_.bytes.size()) {
    return source_.corrupt("it declares more values than the file could hold");
  }
  if (const Json* sparse = member(json, "sparse"); sparse != nullptr) RELIEF_CHECK(apply_sparse(*sparse, item, out));
  return out;
}

Status GltfBuffers::apply_sparse(const Json& sparse, std::size_t item, Accessor& out) {
  const auto bad = [&] { return source_.corrupt("its sparse values are malformed"); };
  const Json* where = member(sparse, "indices");
  const Json* what = member(sparse, "values");
  const auto changed = whole(sparse, "count");
  if (where == nullptr || what == nullptr || !changed || *changed > out.count) return bad();
  const std::uint64_t type = whole(*where, "componentType", 0).value_or(0);
  if (type != kUnsignedByte && type != kUnsignedShort && type != kUnsignedInt) return bad();
  const auto where_offset = whole(*where, "byteOffset", 0);
  const auto what_offset = whole(*what, "byteOffset", 0);
  if (!where_offset || !what_offset) return bad();
  Accessor places;
  places.components = 1;
  places.type = static_cast<std::uint16_t>(type);
  std::size_t value_stride = 0;
  RELIEF_TRY(places.data,
             in_view({whole(*where, "bufferView"), *where_offset, *changed, component_size(type)}, places.stride));
  RELIEF_TRY(const char* const values,
             in_view({whole(*what, "bufferView"), *what_offset, *changed, item}, value_stride));
  std::string dense(out.count * item, '\0');
  for (std::size_t k = 0; out.data != nullptr && k < out.count; ++k)
    std::memcpy(dense.data() + k * item, out.data + k * out.stride, item);
  for (std::size_t k = 0; k < *changed; ++k) {
    const auto place = static_cast<std::size_t>(places.value(k, 0));
    if (place >= out.count) return bad();
    std::memcpy(dense.data() + place * item, values + k * value_stride, item);
  }
  dense_.push_back(std::make_unique<std::string>(std::move(dense)));
  out.data = dense_.back()->data();
  out.stride = item;
  return {};
}

}  // namespace relief::detail
