// The acceptance tests of touch, S1 to S23: each measures its figures and prints them beside their thresholds.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relief::acceptance {

/// One figure of a test.
struct Figure {
  enum class Bound { AtMost, AtLeast, None };
  std::string what;
  double value = 0;
  Bound bound = Bound::None;
  double limit = 0;
  std::string unit;  ///< of value and limit; empty for counts and ratios

  /// A figure that is no number fails.
  [[nodiscard]] bool holds() const noexcept;
};

/// One of so many parts of a run, which together are the whole.
struct Part {
  int number = 1, of = 1;
};

/// What one test found. Each call prints its line at once.
class Report {
 public:
  explicit Report(bool in_long_form, Part part = {}) noexcept : long_form_(in_long_form), part_(part) {}

  /// The long form has more ticks, contacts, paths; the short one ends within some ten CPU seconds.
  [[nodiscard]] bool long_form() const noexcept { return long_form_; }
  /// S8 alone has parts; the others run whole.
  [[nodiscard]] Part part() const noexcept { return part_; }
  void at_most(std::string what, double value, double limit, std::string unit = {});
  void at_least(std::string what, double value, double limit, std::string unit = {});
  /// Never fails: times on a machine that is shared, sizes of what was tried.
  void shown(std::string what, double value, std::string unit = {});
  /// The test could not be made, or a part of it; says why. Not a pass.
  void skipped(std::string why);

  [[nodiscard]] const std::vector<Figure>& figures() const noexcept { return figures_; }
  [[nodiscard]] const std::vector<std::string>& skips() const noexcept { return skips_; }
  /// False when a figure fails, or when there is neither a figure nor a skip.
  [[nodiscard]] bool passed() const noexcept;

 private:
  void add(Figure figure);
  bool long_form_;
  Part part_;
  std::vector<Figure> figures_;
  std::vector<std::string> skips_;
};

struct Test {
  std::string_view id;  ///< "S1"
  std::string_view title;
  void (*run)(Report&);
};

void plant(Report&);              // S1
void limit_cycles(Report&);       // S2
void human_port(Report&);         // S3
void closed_ways(Report&);        // S4
void force_continuity(Report&);   // S5
void borders_and_edits(Report&);  // S6
void sculpting(Report&);          // S7
void pops(Report&);               // S8
void friction(Report&);           // S9
void identification(Report&);     // S10
void texture(Report&);            // S11
void safe_state(Report&);         // S12
void start_and_resume(Report&);   // S13
void limits(Report&);             // S14
void standstill(Report&);         // S15
void work_per_tick(Report&);      // S16
void deadlines(Report&);          // S17
void forbidden_calls(Report&);    // S18
void determinism(Report&);        // S19
void recorded_motion(Report&);    // S20
void ground_truth(Report&);       // S21
void hand_over(Report&);          // S22
void god_object(Report&);         // S23

}  // namespace relief::acceptance
