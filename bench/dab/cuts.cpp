#include "cuts.h"
namespace relief::bench {
Result<nlohmann::ordered_json> measure_cuts(Extent) { return nlohmann::ordered_json::array(); }
}  // namespace relief::bench
