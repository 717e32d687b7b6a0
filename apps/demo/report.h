// One page that shows what the demo did and judges it; nothing outside the page is needed to read it.
#pragma once

#include "claims.h"

#include <relief/convert/convert.h>
#include <relief/edit/tools.h>
#include <relief/session/document.h>
#include <relief/session/session.h>

#include <filesystem>
#include <string>
#include <vector>

namespace relief::demo {

struct Figure {
  std::filesystem::path png;
  std::string title;    ///< what it shows, some words
  std::string caption;  ///< what one sees in it, sentences
};

struct Report {
  std::string title;
  std::string model_name;
  ConvertReport conversion;
  std::string conversion_verdict;  ///< as `relief convert` says it, without a full stop
  double convert_seconds = 0;      ///< CPU, all threads
  double force_max = 0;            ///< N
  double stuck_for = 0;            ///< s, longest time at all that the hand can pull with
  SessionStats stats;
  DocumentStatistics edits;
  std::vector<ServoSample> trace;  ///< of every tick
  std::vector<Tool> tools;         ///< of the brushes, as the buttons choose them
  ServoTimes null_loop;
  std::uint64_t frames = 0;      ///< drawn while the servo ran
  double frame_cpu_seconds = 0;  ///< median per frame
  std::uint64_t frame_triangles = 0;
  SnapshotPtr before, after;          ///< of the 3D view
  double azimuth = 0, elevation = 0;  ///< degrees, of its first view
  std::vector<Claim> claims;
  std::vector<Figure> figures;
};

/// HTML with the pictures, the drawings and the model inside it, less than 8 MB. Errors: Io.
[[nodiscard]] Status write_report(const Report& report, const std::filesystem::path& file);
/// The verdict, claim by claim, for programs. Errors: Io.
[[nodiscard]] Status write_verdict(const Report& report, const std::filesystem::path& file);

}  // namespace relief::demo
