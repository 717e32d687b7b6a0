// unoptimised_forces TICKS: the forces of the script of S19 on standard output, as raw doubles. Built without
// optimisation, the parts of the product with it.
#include "support/forces_of_a_script.h"

#include <cstdio>
#include <cstdlib>

int main(int count, char** words) {
  if (count != 2) return 2;
  for (const relief::ServoSample& felt : relief::testing::forces_of_a_script(std::strtoul(words[1], nullptr, 10)))
    if (std::fwrite(&felt.force, sizeof felt.force, 1, stdout) != 1) return 1;
  return 0;
}
