// S19: the same motion gives the same forces, to the bit, from another build too.
#include "acceptance/acceptance.h"
#include "support/bits.h"
#include "support/forces_of_a_script.h"

#include <cmath>
#include <cstdio>
#include <string>

namespace relief::acceptance {

void determinism(Report& report) {
  const auto tools = testing::held_tools(0);
  for (std::size_t tool = 0; tool < tools.size(); ++tool) {
    const std::string held = tools[tool].name;
    const std::size_t ticks = report.long_form() ? 300'000 : 20'000 / static_cast<std::size_t>(tools[tool].dear);
    const auto once = testing::forces_of_a_script(tool, ticks), again = testing::forces_of_a_script(tool, ticks);
    long touched = 0, differ = 0;
    for (std::size_t k = 0; k < ticks; ++k) {
      touched += once[k].contact ? 1 : 0;
      const bool same = testing::bits(once[k].force) == testing::bits(again[k].force) &&
                        testing::bits(once[k].torque) == testing::bits(again[k].torque) &&
                        testing::bits(once[k].contact_point) == testing::bits(again[k].contact_point) &&
                        once[k].flags == again[k].flags;
      differ += same ? 0 : 1;
    }
    report.at_least("ticks in contact" + held, double(touched), double(ticks) / 4);
    report.at_most("ticks that differ between two runs" + held, double(differ), 0);

    const std::string command =
        std::string(RELIEF_UNOPTIMISED_FORCES) + " " + std::to_string(tool) + " " + std::to_string(ticks);
    std::FILE* other = popen(command.c_str(), "r");
    if (other == nullptr) return report.skipped("the unoptimised build cannot be run");
    double most = 0;
    std::size_t read = 0;
    for (Vec3d force; read < ticks && std::fread(&force, sizeof force, 1, other) == 1; ++read)
      most = std::max(most, length(force - once[read].force));
    if (pclose(other) != 0) read = 0;
    report.at_least("ticks of a build without optimisation" + held, double(read), double(ticks));
    report.at_most("largest difference of its forces" + held, most, 0, "N");
  }
}

}  // namespace relief::acceptance
