#include "hand_text.h"

#include <QCoreApplication>

namespace relief::studio {

namespace {

/// Its sentences stand together for a translator.
struct HandText {
  Q_DECLARE_TR_FUNCTIONS(HandText)
};

/// Why there is no force, up to "; forces ...".
QString reason(ServoFault cause) {
  switch (cause) {
    case ServoFault::DeviceLost:
      return HandText::tr("The device does not answer; it is tried again.");
    case ServoFault::TooFast:
      return HandText::tr("The hand moved too fast; forces are off until you let go.");
    case ServoFault::SurfaceJumped:
      return HandText::tr("The surface changed under the hand; forces are off until you lift off.");
    case ServoFault::Stalled:
      return HandText::tr("The computer stood still for a moment; forces are off until you lift off.");
    case ServoFault::Reconnected:
      return HandText::tr("The device answers again; forces come back when you lift off.");
    case ServoFault::ForcesOff:
      return HandText::tr("Forces come back when you lift off the surface.");
    case ServoFault::StartInside:
      return HandText::tr("The tool is inside the model; forces come when you have pulled it out.");
    case ServoFault::BadPosition:
      return HandText::tr("The device gave a position that cannot be right; forces are off until you lift off.");
    case ServoFault::BadTime:
      return HandText::tr("The device's clock jumped; forces are off until you lift off.");
    default:
      return HandText::tr("Forces are off until you lift off.");
  }
}

QString limit(ServoFault cause) {
  switch (cause) {
    case ServoFault::ForceClamped:
      return HandText::tr("You press harder than the force limit.");
    case ServoFault::LoadLimited:
      return HandText::tr("The motors rest: less force for a while.");
    case ServoFault::SpeedLimited:
      return HandText::tr("Slower, please: the hand is being braked.");
    case ServoFault::LateTicks:
      return HandText::tr("The computer is busy; the surface feels softer.");
    case ServoFault::Uncalibrated:
      return HandText::tr("The arm turns but does not move: is it calibrated?");
    default:
      return HandText::tr("Holding the surface, with less force than it asks for.");
  }
}

}  // namespace

QString safety_sentence(const HandSafety& safety, bool switched_off) {
  if (switched_off) return HandText::tr("Forces are off. You switched them off.");
  switch (safety.state) {
    case HandState::Waiting:
      return HandText::tr("Waiting for the device.");
    case HandState::Free:
      return HandText::tr("In the air. All is well.");
    case HandState::Touching:
      return HandText::tr("Holding the surface. All is well.");
    case HandState::Limited:
      return limit(safety.cause);
    case HandState::NoForce:
      if (safety.cause == ServoFault::ForcesOff && !safety.lift_off)
        return HandText::tr("The device has switched its forces off itself.");
      return reason(safety.cause);
  }
  return {};
}

QString alarm_sentence(const HandStop& stop) {
  // A tool that begins inside the model, or forces that somebody switches off here, surprise nobody.
  const ServoFault cause = stop.cause;
  if (cause == ServoFault::StartInside || cause == ServoFault::None || cause == ServoFault::ForcesOff) return {};
  if (cause == ServoFault::Reconnected && stop.over) return HandText::tr("The device answers again.");
  return reason(cause);
}

QString safety_role(HandState state) {
  switch (state) {
    case HandState::Touching:
      return QStringLiteral("good");
    case HandState::Limited:
      return QStringLiteral("warn");
    case HandState::NoForce:
      return QStringLiteral("bad");
    default:
      return QStringLiteral("dim");
  }
}

QString state_word(HandState state) {
  switch (state) {
    case HandState::Waiting:
      return QStringLiteral("waiting");
    case HandState::Free:
      return QStringLiteral("free");
    case HandState::Touching:
      return QStringLiteral("touching");
    case HandState::Limited:
      return QStringLiteral("limited");
    case HandState::NoForce:
      return QStringLiteral("no force");
  }
  return {};
}

QString evidence_text(Evidence evidence) {
  switch (evidence) {
    case Evidence::Simulated:
      return HandText::tr("simulated");
    case Evidence::ContractTested:
      return HandText::tr("contract-tested against a fake; never run on hardware");
    case Evidence::FieldTested:
      return HandText::tr("field-tested");
  }
  return {};
}

}  // namespace relief::studio
