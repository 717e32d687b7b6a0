// What the hand is told, in sentences.
#pragma once

#include <relief/devices/open_device.h>
#include <relief/session/hand_monitor.h>

#include <QString>

namespace relief::studio {

/// One sentence for the state at the moment. `switched_off`: somebody has switched the forces off here.
[[nodiscard]] QString safety_sentence(const HandSafety& safety, bool switched_off);
/// What people should know of a time without force even after it is over; empty where the state says enough.
[[nodiscard]] QString alarm_sentence(const HandStop& stop);
/// The role of a label that holds such a sentence: good, dim, warn or bad.
[[nodiscard]] QString safety_role(HandState state);
/// A word for the state, for logs and tests; not translated.
[[nodiscard]] QString state_word(HandState state);
/// What is claimed of a kind of device.
[[nodiscard]] QString evidence_text(Evidence evidence);

}  // namespace relief::studio
