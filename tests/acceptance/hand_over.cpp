// S22: snapshots go from the writer to readers whole, and nobody waits.
#include "acceptance/acceptance.h"
#include "support/hand_over_runs.h"

#include <algorithm>

namespace relief::acceptance {

void hand_over(Report& report) {
  const testing::HandOver done = testing::hand_over_runs(report.long_form() ? 1'000'000'000 : 3'000'000, 3);
  report.at_least("exchanges", double(done.reads), report.long_form() ? 1e9 : 3e6);
  report.shown("snapshots published meanwhile", double(done.published));
  report.at_least("of them seen", double(done.seen_new), 10);
  report.at_most("torn, or not the sum that was written into them", double(done.torn), 0);
  report.at_most("snapshots kept by three readers", double(done.most_held), 1 + 2 * 3);
}

}  // namespace relief::acceptance
