// What this program is called where it signs its work.
#pragma once

#include <string>

namespace relief::cli {

/// "relief VERSION (COMMIT)"; without the commit where the sources were no checkout.
[[nodiscard]] std::string program();

}  // namespace relief::cli
