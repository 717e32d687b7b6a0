// One page that shows what the demo did; nothing outside the page is needed to read it.
#pragma once

#include <relief/convert/convert.h>
#include <relief/session/document.h>
#include <relief/session/session.h>

#include <filesystem>
#include <string>
#include <vector>

namespace relief::demo {

struct Figure {
  std::filesystem::path png;
  std::string caption;
};

struct Report {
  std::string title;
  std::string model_name;
  ConvertReport conversion;
  double convert_seconds = 0;  ///< CPU, all threads
  double force_max = 0;        ///< N
  double stuck_for = 0;        ///< s, longest time at the largest force that the device gives
  SessionStats stats;
  DocumentStatistics edits;
  std::vector<ServoSample> trace;  ///< of every tick
  ServoTimes null_loop;
  std::uint64_t frames = 0;      ///< drawn while the servo ran
  double frame_cpu_seconds = 0;  ///< median per frame
  std::uint64_t frame_triangles = 0;
  bool reload_identical = false;
  std::vector<Figure> figures;
};

/// HTML with the pictures and drawings inside it. Errors: Io.
[[nodiscard]] Status write_report(const Report& report, const std::filesystem::path& file);

}  // namespace relief::demo
