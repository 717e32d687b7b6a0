// How much memory the verifier takes, counted by the allocator.
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <malloc.h>
#include <support/shells.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <vector>

namespace {

/// What lives on the heap, and the most that did since `most` was last set; bytes. The verifier has one thread.
struct Heap {
  std::size_t now = 0, most = 0;
};
thread_local Heap heap;

void* counted_new(std::size_t size, std::size_t alignment) {
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(std::max<std::size_t>(size, 1))
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  heap.now += malloc_usable_size(memory);
  heap.most = std::max(heap.most, heap.now);
  return memory;
}
void counted_delete(void* memory) noexcept {
  heap.now -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return counted_new(size, 1); }
void* operator new[](std::size_t size) { return counted_new(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted_new(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted_new(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { counted_delete(memory); }
void operator delete[](void* memory) noexcept { counted_delete(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { counted_delete(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { counted_delete(memory); }
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept { counted_delete(memory); }
void operator delete[](void* memory, std::align_val_t /*alignment*/) noexcept { counted_delete(memory); }
void operator delete(void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  counted_delete(memory);
}
void operator delete[](void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  counted_delete(memory);
}

namespace relief::verify {
namespace {

using Points = std::vector<std::array<double, 3>>;
using Faces = std::vector<std::array<std::uint32_t, 3>>;

/// A sphere of 8 * 4^levels slabs: the ends of its fibres, on a lattice, and the slabs.
struct Sphere {
  Points inner, outer;
  Faces faces;

  Sphere(int levels, double inside, double outside) {
    const auto on_lattice = [](Vec3d p) {
      return std::array{std::round(p.x * 0x1p20) * 0x1p-20, std::round(p.y * 0x1p20) * 0x1p-20,
                        std::round(p.z * 0x1p20) * 0x1p-20};
    };
    const auto mesh = testing::sphere_shell(levels, 1, inside, outside);
    for (const Fibre& f : mesh->fibres()) {
      inner.push_back(on_lattice(f.inner));
      outer.push_back(on_lattice(f.outer));
    }
    for (const relief::Slab& s : mesh->slabs()) faces.push_back(s.fibres);
  }
};

/// The most that the verifier has on the heap; bytes.
std::size_t most_for(const Sphere& shell, const Sphere& source) {
  const std::size_t before = heap.most = heap.now;
  const Certificate certificate = check({shell.inner, shell.outer, shell.faces}, Source{source.outer, source.faces});
  EXPECT_TRUE(certificate.all());
  return heap.most - before;
}

TEST(VerifyMemory, OfASlabOnlyALittleIsHeldForTheWholeOfTheCheck) {
  // Boxes, their tree and the shell's own data; what is asked of a slab again and again would be 1500 more.
  constexpr double kMost = 200;
  const Sphere source(5, 0.5, 1.0), few(5, 0.8, 1.2), many(6, 0.8, 1.2);
  const auto more = static_cast<double>(most_for(many, source)) - static_cast<double>(most_for(few, source));
  EXPECT_LT(more / static_cast<double>(many.faces.size() - few.faces.size()), kMost);
}

TEST(VerifyMemory, OfASourceTriangleAFewNumbersAreHeld) {
  constexpr double kMost = 80;
  const Sphere shell(2, 0.8, 1.2), few(5, 0.5, 1.0), many(6, 0.5, 1.0);
  const auto more = static_cast<double>(most_for(shell, many)) - static_cast<double>(most_for(shell, few));
  EXPECT_LT(more / static_cast<double>(many.faces.size() - few.faces.size()), kMost);
}

}  // namespace
}  // namespace relief::verify
