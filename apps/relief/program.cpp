#include "program.h"

#include "commit.h"

namespace relief::cli {

std::string program() {
  std::string text = "relief " RELIEF_VERSION;
  if (const std::string commit = RELIEF_COMMIT; !commit.empty()) text.append(" (").append(commit).append(")");
  return text;
}

}  // namespace relief::cli
