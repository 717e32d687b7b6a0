// unoptimised_forces TOOL TICKS: the forces of the script of S19 with tool 0, 1 or 2 of held_tools() on standard
// output, as raw doubles. Built without optimisation, the parts of the product with it.
#include "support/forces_of_a_script.h"

#include <cstdio>
#include <cstdlib>

int main(int count, char** words) {
  if (count != 3) return 2;
  const std::size_t tool = std::strtoul(words[1], nullptr, 10), ticks = std::strtoul(words[2], nullptr, 10);
  if (tool > 2) return 2;
  for (const relief::ServoSample& felt : relief::testing::forces_of_a_script(tool, ticks))
    if (std::fwrite(&felt.force, sizeof felt.force, 1, stdout) != 1) return 1;
  return 0;
}
