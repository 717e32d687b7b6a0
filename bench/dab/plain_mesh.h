// A plain indexed mesh that is sculpted as a good C++ program would: what slabs are compared with.
#pragma once

#include <relief/core/tessellate.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace relief::bench {

/// Vertices along a curve that keeps neighbours together, in leaves of 1024, each with its box in a tree of boxes.
/// A dab finds its leaves, keeps a copy of each the first time a stroke comes there, moves or colours the vertices
/// inside the sphere, renews the normals of all vertices whose triangles may have moved, and the boxes. Single
/// precision, one plane per coordinate; the loops become AVX2 with gathers where the compiler can. One thread.
class PlainMesh {
 public:
  enum class Kernel : std::uint8_t { Carve, Deposit, Paint, Smooth };
  /// Lengths in model units. Carve cuts with the ball around `centre`, along `up`; the others fall off linearly from
  /// `centre` to `radius`.
  struct Dab {
    Kernel kernel = Kernel::Deposit;
    Vec3f centre, up;
    float radius = 1;
    float amount = 0;  ///< Deposit: length at the centre; Paint, Smooth: share at the centre, 0..1
    Vec3f colour = {};
  };
  static constexpr std::size_t kLeaf = 1024, kRing = 6;

  /// Of a closed surface whose vertices have at most six neighbours each (asserted).
  explicit PlainMesh(const Tessellation& surface);
  PlainMesh(const PlainMesh&) = delete;
  PlainMesh& operator=(const PlainMesh&) = delete;

  /// A stroke has one kernel.
  void begin_stroke();
  /// How many vertices it changed.
  std::size_t dab(const Dab& dab);
  /// Takes the stroke back.
  void undo();

  [[nodiscard]] std::size_t vertex_count() const noexcept { return count_; }
  /// Of everything that it holds, copies for undo left out.
  [[nodiscard]] std::size_t bytes() const noexcept;
  [[nodiscard]] Vec3f position(std::size_t v) const noexcept { return {at_[0][v], at_[1][v], at_[2][v]}; }
  [[nodiscard]] Vec3f normal(std::size_t v) const noexcept { return {normals_[0][v], normals_[1][v], normals_[2][v]}; }

 private:
  using Plane = std::vector<float>;
  struct Box {
    Vec3f low, high;
  };
  /// Of a leaf, three planes.
  using Copy = std::vector<float>;

  void keep(std::size_t leaf);
  std::size_t move(const Dab& dab);
  void list_moved(const Dab& dab);
  void renew_normals();
  void find_leaves(Vec3f centre, float radius);
  void find_box(std::size_t leaf);
  void refit();

  std::size_t count_ = 0, leaves_ = 0;  ///< vertices; leaves, the last one filled up with copies of the last vertex
  float longest_edge_ = 0;              ///< before any stroke, model units
  std::array<Plane, 3> at_, normals_, colours_;
  std::array<std::vector<std::int32_t>, kRing> ring_;  ///< neighbours, counter-clockwise; the last one repeated
  std::vector<std::vector<Box>> tree_;  ///< level 0: of the leaves; each next level of eight boxes of the one below

  std::vector<std::uint32_t> found_, changed_leaves_;
  std::vector<std::int32_t> list_;
  std::array<Plane, 3> moved_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::unique_ptr<Copy>> undo_;  ///< by leaf
  std::vector<std::uint32_t> kept_;          ///< leaves that have one
  std::array<Plane, 3>* written_ = &at_;     ///< by the open stroke
  std::vector<std::unique_ptr<Copy>> idle_;
};

}  // namespace relief::bench
