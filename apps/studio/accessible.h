// What assistive tools, and tests, are told about controls of our own.
#pragma once

namespace relief::studio {

/// Call once, before the first window. The viewport becomes a canvas whose description is its state.
void install_accessibility();

}  // namespace relief::studio
