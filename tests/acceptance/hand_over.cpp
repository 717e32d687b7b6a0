// S22: snapshots go from the writer to readers whole, and nobody waits.
#include "acceptance/acceptance.h"
#include "support/hand_over_runs.h"

#include <cstdint>

namespace relief::acceptance {

void hand_over(Report& report) {
  const std::uint64_t reads = report.long_form() ? 1'000'000'000 : 3'000'000;
  const std::uint64_t exchanges = report.long_form() ? 10'000'000 : 100'000;
  const testing::HandOver done = testing::hand_over_runs(reads, exchanges, 3);
  report.at_least("reads by three readers", double(done.reads), double(reads));
  report.at_least("of them exchanges: the reader's snapshot is another one", double(done.exchanges), double(exchanges));
  report.shown("    of the reader with the fewest", double(done.fewest));
  report.shown("snapshots published meanwhile", double(done.published));
  report.at_most("torn, or not the sum that was written into them", double(done.torn), 0);
  report.at_most("snapshots kept by three readers", double(done.most_held), 1 + 2 * 3);
}

}  // namespace relief::acceptance
