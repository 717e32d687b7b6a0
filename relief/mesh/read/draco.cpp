#include <relief/base/try.h>
#include <relief/mesh/read/draco.h>
#include <relief/mesh/read/face_paint.h>
#include <relief/mesh/read/readers.h>

#if RELIEF_WITH_DRACO
#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#endif

namespace relief::detail {

#if RELIEF_WITH_DRACO

namespace {

constexpr std::int32_t kMostAttributes = 32;
constexpr std::uint64_t kMostFree = 1000;  ///< faces and points that any file may have
constexpr std::uint64_t kMostPerByte = 8;  ///< faces and points of each byte; scans take about one byte for a face

/// A decoder of the library that looks at counts before it makes room for them: the library believes what it reads.
template <typename Base>
class Bounded : public Base {
 public:
  explicit Bounded(std::uint64_t bytes) noexcept : most_(kMostFree + kMostPerByte * bytes) {}

 protected:
  bool DecodeConnectivity() override {
    draco::DecoderBuffer ahead = *this->buffer();
    std::uint32_t first = 0, second = 0;  // faces and points, or points and faces
    if (this->bitstream_version() < DRACO_BITSTREAM_VERSION(2, 2)) return false;
    if (!draco::DecodeVarint(&first, &ahead) || !draco::DecodeVarint(&second, &ahead)) return false;
    return first <= most_ && second <= most_ && Base::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    return this->point_cloud()->num_attributes() <= kMostAttributes && Base::DecodeAllAttributes();
  }

 private:
  std::uint64_t most_;
};

template <typename Decoder>
draco::Status decode_with(draco::DecoderBuffer& buffer, std::size_t bytes, draco::Mesh& mesh) {
  Decoder decoder(bytes);
  const draco::DecoderOptions options;
  return decoder.Decode(options, &buffer, &mesh);
}

DracoAttribute::Kind kind_of(draco::GeometryAttribute::Type type) noexcept {
  switch (type) {
    case draco::GeometryAttribute::POSITION:
      return DracoAttribute::Kind::Position;
    case draco::GeometryAttribute::COLOR:
      return DracoAttribute::Kind::Colour;
    case draco::GeometryAttribute::TEX_COORD:
      return DracoAttribute::Kind::Place;
    default:
      return DracoAttribute::Kind::Other;
  }
}

/// Types that glTF has; nothing for others, whose values become floats.
std::optional<std::uint16_t> type_of(draco::DataType type) noexcept {
  switch (type) {
    case draco::DT_INT8:
      return kByte;
    case draco::DT_UINT8:
      return kUnsignedByte;
    case draco::DT_INT16:
      return kShort;
    case draco::DT_UINT16:
      return kUnsignedShort;
    case draco::DT_UINT32:
      return kUnsignedInt;
    case draco::DT_FLOAT32:
      return kFloat;
    default:
      return std::nullopt;
  }
}

/// Copies the values of all points out of an attribute, where points may share them. Nothing when they do not lie in
/// it.
std::optional<DracoAttribute> copy_of(const draco::PointAttribute& from, std::uint32_t points) {
  DracoAttribute out;
  out.kind = kind_of(from.attribute_type());
  out.id = from.unique_id();
  out.components = static_cast<std::size_t>(from.num_components());
  out.normalised = from.normalized();
  const auto type = type_of(from.data_type());
  out.type = type.value_or(kFloat);
  const std::size_t size = type ? static_cast<std::size_t>(draco::DataTypeLength(from.data_type())) : sizeof(float);
  const std::size_t item = size * out.components;
  if (out.components == 0 || out.components > 4) return std::nullopt;
  out.bytes.resize(item * points);
  for (std::uint32_t k = 0; k < points; ++k) {
    const draco::AttributeValueIndex at = from.mapped_index(draco::PointIndex(k));
    if (at.value() >= from.size()) return std::nullopt;
    char* const to = out.bytes.data() + k * item;
    if (type) {
      from.GetValue(at, to);
    } else {
      std::array<float, 4> values{};
      if (!from.ConvertValue<float>(at, static_cast<std::int8_t>(out.components), values.data())) return std::nullopt;
      std::memcpy(to, values.data(), item);
    }
  }
  return out;
}

}  // namespace

Result<DracoMesh> decode_draco(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::DecoderBuffer ahead = buffer;
  draco::DracoHeader header;
  const auto damaged = [](std::string_view why) {
    return fail(Errc::Corrupt, "cannot be decoded: " + printable(std::string(why), 100));
  };
  if (const auto status = draco::PointCloudDecoder::DecodeHeader(&ahead, &header); !status.ok())
    return damaged(status.error_msg_string());
  if (header.encoder_type != draco::TRIANGULAR_MESH)
    return fail(Errc::UnsupportedFormat, "hold points but no faces; a surface is needed");
  draco::Mesh mesh;
  const bool sequential = header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING;
  const draco::Status status = sequential
                                   ? decode_with<Bounded<draco::MeshSequentialDecoder>>(buffer, bytes.size(), mesh)
                                   : decode_with<Bounded<draco::MeshEdgebreakerDecoder>>(buffer, bytes.size(), mesh);
  if (!status.ok()) return damaged(status.error_msg_string());

  DracoMesh out;
  out.points = mesh.num_points();
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(f);
    out.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
    if (std::ranges::max(out.triangles.back()) >= out.points) return damaged("a face names a point that is missing");
  }
  for (std::int32_t k = 0; k < mesh.num_attributes(); ++k) {
    auto attribute = copy_of(*mesh.attribute(k), mesh.num_points());
    if (attribute) out.attributes.push_back(*std::move(attribute));
  }
  return out;
}

#else

Result<DracoMesh> decode_draco(std::string_view) {
  return fail(Errc::UnsupportedFormat, "need a decoder that this build leaves out; export it without compression");
}

#endif

Result<TriangleMesh> read_draco(const Source& source) {
  if (source.progress.cancelled()) return source.cancelled();
  auto decoded = decode_draco(source.bytes);
  if (!decoded) return source.error(decoded.error().code, "its Draco data " + decoded.error().message);
  const auto find = [&](DracoAttribute::Kind kind) -> std::optional<Accessor> {
    const auto at = std::ranges::find(decoded->attributes, kind, &DracoAttribute::kind);
    if (at == decoded->attributes.end()) return std::nullopt;
    return at->values(decoded->points);
  };
  const auto places = find(DracoAttribute::Kind::Position);
  if (!places || places->components != 3) return source.corrupt("its Draco data have no positions");
  if (decoded->triangles.empty()) return source.error(Errc::UnsupportedFormat, "holds no faces");
  TriangleMesh mesh;
  mesh.triangles = std::move(decoded->triangles);
  Steps steps = source.steps(places->count);
  for (std::size_t k = 0; k < places->count; ++k) {
    if (!steps.next()) return source.cancelled();
    mesh.positions.push_back(places->vec3(k));
  }
  if (auto colours = find(DracoAttribute::Kind::Colour); colours && colours->components >= 3) {
    colours->normalised = true;
    for (std::size_t k = 0; k < colours->count; ++k) {
      const Vec3d c = colours->vec3(k);
      mesh.colours.push_back({unit_to_byte(c.x), unit_to_byte(c.y), unit_to_byte(c.z),
                              colours->components == 4 ? unit_to_byte(colours->value(k, 3)) : std::uint8_t{255}});
    }
  }
  if (find(DracoAttribute::Kind::Place) && !mesh.has_colour()) mesh.notes.emplace_back(kPlacesWithoutImage);
  return mesh;
}

}  // namespace relief::detail
