// What is compared: one way to answer, with what it has built.
#pragma once

#include "ways.h"

#include <cstddef>
#include <optional>
#include <string>

namespace relief::bench {

class Contestant {
 public:
  Contestant() = default;
  Contestant(const Contestant&) = delete;
  Contestant& operator=(const Contestant&) = delete;
  virtual ~Contestant() = default;
  /// Comes before each section of a way, untimed, with its first cursor and the surface's unit normal there.
  virtual void approach(Vec3d /*first*/, Vec3d /*up*/) {}
  /// Once per frame, timed. `coherent`: the last answer may help to find this one, as from one tick to the next.
  /// Returns some number that depends on the answer, so that no compiler leaves the work out.
  virtual double ask(Vec3d cursor, bool coherent) = 0;
  /// The same, untimed; empty where there is no answer, as of a contact that is lost.
  virtual std::optional<Nearest> answer(Vec3d cursor, bool coherent) = 0;

  std::string name;
  double build_seconds = 0;                   ///< CPU, all threads
  std::size_t bytes = 0;                      ///< beyond the triangles of the tessellation
  bool cold = false;                          ///< is asked with nothing in the caches, too
  bool has_nearest = true;                    ///< answer() means a nearest point, which can be right or wrong
  std::size_t most_frames = ~std::size_t{0};  ///< of each way, for what takes long
};

}  // namespace relief::bench
