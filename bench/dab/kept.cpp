#include "kept.h"
namespace relief::bench {
nlohmann::ordered_json measure_memory(Extent) { return nlohmann::ordered_json::array(); }
Result<nlohmann::ordered_json> measure_file(Extent) { return nlohmann::ordered_json::array(); }
}  // namespace relief::bench
