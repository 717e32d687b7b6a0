// A device at an exhibition: visitors feel with it what the curator allows.
#pragma once

#include "hand.h"
#include "hand_overlay.h"
#include "panic_keys.h"

namespace relief::studio {

class Kiosk;

/// Runs the device on the model that visitors have, within the exhibit's force cap. While models turn by themselves, or
/// are chosen, there is no force. A device that a person holds counts as somebody being there.
class KioskHand : public QObject {
 public:
  /// `device`: an id of Hand::choose(). Must not outlive the kiosk.
  KioskHand(Kiosk& kiosk, const QString& device);

 private:
  void show_page();
  void show_tick();

  Kiosk& kiosk_;
  Hand hand_;
  HandOverlay overlay_;
  PanicKeys panic_;
};

}  // namespace relief::studio
