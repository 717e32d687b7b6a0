// What happens to the document, in the event log.
#pragma once

#include "bridge.h"
#include "viewport.h"

namespace relief::studio {

/// Writes a line for each stroke, each move in the history and each save, for as long as both live.
void log_document(DocumentBridge& bridge, const Viewport& viewport);

}  // namespace relief::studio
