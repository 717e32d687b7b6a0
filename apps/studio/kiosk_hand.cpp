#include "kiosk_hand.h"

#include "kiosk.h"
#include "viewport.h"

namespace relief::studio {

KioskHand::KioskHand(Kiosk& kiosk, const QString& device)
    : kiosk_(kiosk), hand_(kiosk.bridge(), kiosk.tools()), panic_([this] { hand_.set_forces(false); }) {
  Viewport& viewport = kiosk.viewport();
  viewport.add_overlay(&overlay_);
  connect(&kiosk, &Kiosk::forceCapChanged, &hand_, &Hand::set_force_cap);
  connect(&kiosk, &Kiosk::pageChanged, this, &KioskHand::show_page);
  connect(&hand_, &Hand::ticked, this, &KioskHand::show_tick);
  connect(&hand_, &Hand::changed, this, [this] {
    panic_.set_on(hand_.active());
    if (hand_.active()) return;
    overlay_.shown.reset();
    kiosk_.viewport().update_overlays();
  });
  connect(&viewport, &Viewport::pointed, &hand_, &Hand::point);
  connect(&viewport, &Viewport::left, &hand_, &Hand::leave);
  hand_.choose(device);
  show_page();
}

void KioskHand::show_page() { hand_.set_forces(kiosk_.page() == Kiosk::Page::Model); }

void KioskHand::show_tick() {
  const ServoSample& sample = hand_.monitor().last();
  overlay_.shown = {.sample = sample, .force_limit = hand_.force_limit(), .has_orientation = false};
  kiosk_.viewport().update_overlays();
  if (hand_.held()) kiosk_.hand_at(sample.device);
}

}  // namespace relief::studio
