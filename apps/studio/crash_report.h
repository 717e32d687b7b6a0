// What is said when the studio ends by a signal, for those who look for the cause.
#pragma once

namespace relief::studio {

/// From here on a fault (a bad address, a failed assertion) writes the way that led there to standard error: one line
/// per call, with an address that addr2line turns into a line of the source. The program then ends as it would have,
/// and leaves a core file where the system allows one. Signals that something else handles already are left to it.
/// Called once, on the UI thread; of a stack that overflows on another thread nothing is told.
void report_crashes();

}  // namespace relief::studio
