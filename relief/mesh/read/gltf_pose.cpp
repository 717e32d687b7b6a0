#include <relief/base/try.h>
#include <relief/mesh/read/gltf_pose.h>

namespace relief::detail {
namespace {

constexpr std::size_t kMostSets = 16;  ///< of joints, four in each; files have one or two

/// Takes from what may still be read.
[[nodiscard]] bool spend(std::size_t& work, std::size_t amount) noexcept {
  if (amount > work) return false;
  work -= amount;
  return true;
}

std::unexpected<Error> too_much(const Source& source) {
  return source.error(Errc::UnsupportedFormat, "bends its parts by more values than a file of its size can mean");
}

/// A weighted sum of maps.
void add(Placement& sum, const Placement& map, double weight) noexcept {
  for (std::size_t k = 0; k < 3; ++k) sum.axes[k] += map.axes[k] * weight;
  sum.origin += map.origin * weight;
}

}  // namespace

Placement Pose::placement() const noexcept {
  Placement place;
  const auto [x, y, z, w] = turn;
  const double norm = x * x + y * y + z * z + w * w;
  const double s = norm > 0.0 ? 2.0 / norm : 0.0;
  place.axes = {Vec3d{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)} * scale[0],
                Vec3d{s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)} * scale[1],
                Vec3d{s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)} * scale[2]};
  place.origin = {move[0], move[1], move[2]};
  return place;
}

NodeTree::NodeTree(const Source& source, const Json& root) : source_(source), root_(root) {
  const Json* nodes = member(root, "nodes");
  if (nodes == nullptr || !nodes->is_array()) return;
  parents_.assign(nodes->size(), kNone);
  for (std::size_t k = 0; k < nodes->size(); ++k) {
    const Json* children = member((*nodes)[k], "children");
    for (std::size_t c = 0; children != nullptr && children->is_array() && c < children->size(); ++c) {
      if ((*children)[c].is_number_unsigned() && (*children)[c].get<std::uint64_t>() < parents_.size())
        parents_[(*children)[c].get<std::uint64_t>()] = static_cast<std::uint32_t>(k);
    }
  }
}

Result<Placement> NodeTree::local(std::uint64_t index) const {
  const Json* node = element(root_, "nodes", index);
  if (node == nullptr) return source_.corrupt("node " + std::to_string(index) + " is missing");
  const auto bad = [&] { return source_.corrupt("the transform of node " + std::to_string(index) + " is malformed"); };
  if (member(*node, "matrix") != nullptr) {
    std::array<double, 16> m{};
    if (!numbers(*node, "matrix", m)) return bad();
    return Placement{{Vec3d{m[0], m[1], m[2]}, Vec3d{m[4], m[5], m[6]}, Vec3d{m[8], m[9], m[10]}},
                     {m[12], m[13], m[14]}};
  }
  Pose pose;
  if (!numbers(*node, "translation", pose.move) || !numbers(*node, "rotation", pose.turn) ||
      !numbers(*node, "scale", pose.scale))
    return bad();
  return pose.placement();
}

Result<Placement> NodeTree::global(std::uint64_t node) {
  std::vector<std::uint64_t> way;  // from the node up to one that is known
  std::uint64_t at = node;
  while (at != kNone && !globals_.contains(at)) {
    if (at >= parents_.size()) return source_.corrupt("node " + std::to_string(at) + " is missing");
    if (way.size() > parents_.size()) return source_.corrupt("node " + std::to_string(node) + " stands below itself");
    way.push_back(at);
    at = parents_[at];
  }
  Placement place = at == kNone ? Placement{} : globals_.at(at);
  for (std::size_t k = way.size(); k-- > 0;) {
    RELIEF_TRY(const Placement own, local(way[k]));
    place = place * own;
    globals_.emplace(way[k], place);
  }
  return globals_.contains(node) ? globals_.at(node) : place;
}

Status apply_morphs(const Source& source, GltfBuffers& buffers, const PrimitiveVertices& vertices,
                    std::span<const double> weights, std::span<Vec3d> positions, std::size_t& work) {
  const Json* targets = member(vertices.primitive->json(), "targets");
  if (targets == nullptr || !targets->is_array()) return {};
  for (std::size_t k = 0; k < targets->size() && k < weights.size(); ++k) {
    if (weights[k] == 0.0 || member((*targets)[k], "POSITION") == nullptr) continue;
    RELIEF_TRY(const Accessor moves, buffers.accessor(whole((*targets)[k], "POSITION")));
    if (moves.components != 3 || moves.count != vertices.count)
      return source.corrupt("morph target " + std::to_string(k) + " does not fit its primitive");
    if (!spend(work, moves.count)) return too_much(source);
    for (std::size_t v = 0; v < moves.count; ++v) {
      if (source.progress.cancelled()) return source.cancelled();
      positions[vertices.first + v] += moves.vec3(v) * weights[k];
    }
  }
  return {};
}

Result<Skin> Skin::open(const Source& source, GltfBuffers& buffers, NodeTree& nodes, const Json& root,
                        std::optional<std::uint64_t> index) {
  const Json* json = element(root, "skins", index);
  const Json* joints = json != nullptr ? member(*json, "joints") : nullptr;
  const std::string name = std::string("skin ") + (index ? std::to_string(*index) : std::string("?"));
  if (joints == nullptr || !joints->is_array() || joints->empty())
    return source.corrupt(name + " is missing or has no joints");
  std::optional<Accessor> bound;
  if (member(*json, "inverseBindMatrices") != nullptr) {
    RELIEF_TRY(bound, buffers.accessor(whole(*json, "inverseBindMatrices")));
    if (bound->components != 16 || bound->count < joints->size())
      return source.corrupt("the matrices of " + name + " do not fit its joints");
  }
  Skin skin;
  for (std::size_t k = 0; k < joints->size(); ++k) {
    if (!(*joints)[k].is_number_unsigned()) return source.corrupt(name + " names a joint that is no node");
    RELIEF_TRY(Placement joint, nodes.global((*joints)[k].get<std::uint64_t>()));
    if (bound) {
      const auto column = [&](std::size_t c) {
        return Vec3d{bound->value(k, 4 * c), bound->value(k, 4 * c + 1), bound->value(k, 4 * c + 2)};
      };
      joint = joint * Placement{{column(0), column(1), column(2)}, column(3)};
    }
    skin.joints_.push_back(joint);
  }
  return skin;
}

Status Skin::apply(const Source& source, const PrimitiveVertices& vertices, std::span<Vec3d> positions,
                   std::size_t& mirrored, std::size_t& work) const {
  struct Set {
    Accessor joints, weights;
  };
  std::vector<Set> sets;
  while (sets.size() < kMostSets) {
    const std::string number = std::to_string(sets.size());
    RELIEF_TRY(const auto joints, vertices.primitive->attribute(std::string("JOINTS_").append(number)));
    RELIEF_TRY(const auto weights, vertices.primitive->attribute(std::string("WEIGHTS_").append(number)));
    if (!joints || !weights) break;
    if (joints->components != 4 || weights->components != 4 || joints->count != vertices.count ||
        weights->count != vertices.count)
      return source.corrupt(std::string("JOINTS_").append(number) + " does not fit POSITION");
    if (!spend(work, vertices.count)) return too_much(source);
    sets.push_back({*joints, *weights});
  }
  for (std::size_t v = 0; v < vertices.count; ++v) {
    if (source.progress.cancelled()) return source.cancelled();
    Placement sum{{}, {}};
    double all = 0.0;
    for (const Set& set : sets) {
      for (std::size_t k = 0; k < 4; ++k) {
        const double weight = set.weights.value(v, k);
        if (!(weight > 0.0)) continue;
        const double joint = set.joints.value(v, k);
        if (!(joint >= 0.0 && joint < static_cast<double>(joints_.size())))
          return source.corrupt("vertex " + std::to_string(v) + " names joint " +
                                std::to_string(static_cast<std::int64_t>(joint)) + " of " +
                                std::to_string(joints_.size()));
        add(sum, joints_[static_cast<std::size_t>(joint)], weight);
        all += weight;
      }
    }
    if (all == 0.0) continue;
    for (Vec3d& axis : sum.axes) axis *= 1.0 / all;
    sum.origin *= 1.0 / all;
    Vec3d& p = positions[vertices.first + v];
    p = sum.point(p);
    if (sum.mirrors()) ++mirrored;
  }
  return {};
}

}  // namespace relief::detail
