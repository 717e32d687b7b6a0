#include "hand_text.h"

#include <QCoreApplication>

namespace relief::studio {

namespace {

QString tr(const char* words) { return QCoreApplication::translate("HandText", words); }

/// Why there is no force, up to "; forces ...".
QString reason(ServoFault cause) {
  switch (cause) {
    case ServoFault::DeviceLost:
      return tr("The device does not answer; it is tried again.");
    case ServoFault::TooFast:
      return tr("The hand moved too fast; forces are off until you let go.");
    case ServoFault::SurfaceJumped:
      return tr("The surface changed under the hand; forces are off until you lift off.");
    case ServoFault::Stalled:
      return tr("The computer stood still for a moment; forces are off until you lift off.");
    case ServoFault::Reconnected:
      return tr("The device answers again; forces come back when you lift off.");
    case ServoFault::ForcesOff:
      return tr("Forces come back when you lift off the surface.");
    case ServoFault::StartInside:
      return tr("The tool is inside the model; forces come when you have pulled it out.");
    case ServoFault::BadPosition:
      return tr("The device gave a position that cannot be right; forces are off until you lift off.");
    case ServoFault::BadTime:
      return tr("The device's clock jumped; forces are off until you lift off.");
    default:
      return tr("Forces are off until you lift off.");
  }
}

QString limit(ServoFault cause) {
  switch (cause) {
    case ServoFault::ForceClamped:
      return tr("You press harder than the force limit.");
    case ServoFault::LoadLimited:
      return tr("The motors rest: less force for a while.");
    case ServoFault::SpeedLimited:
      return tr("Slower, please: the hand is being braked.");
    case ServoFault::LateTicks:
      return tr("The computer is busy; the surface feels softer.");
    case ServoFault::Uncalibrated:
      return tr("The arm turns but does not move: is it calibrated?");
    default:
      return tr("Holding the surface, with less force than it asks for.");
  }
}

}  // namespace

QString safety_sentence(const HandSafety& safety, bool switched_off) {
  if (switched_off) return tr("Forces are off. You switched them off.");
  switch (safety.state) {
    case HandState::Waiting:
      return tr("Waiting for the device.");
    case HandState::Free:
      return tr("In the air. All is well.");
    case HandState::Touching:
      return tr("Holding the surface. All is well.");
    case HandState::Limited:
      return limit(safety.cause);
    case HandState::NoForce:
      if (safety.cause == ServoFault::ForcesOff && !safety.lift_off)
        return tr("The device has switched its forces off itself.");
      return reason(safety.cause);
  }
  return {};
}

QString alarm_sentence(ServoFault cause) {
  // A tool that begins inside the model, or forces that somebody switches off here, surprise nobody.
  if (cause == ServoFault::StartInside || cause == ServoFault::None || cause == ServoFault::ForcesOff) return {};
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
      return tr("simulated");
    case Evidence::ContractTested:
      return tr("contract-tested against a fake; never run on hardware");
    case Evidence::FieldTested:
      return tr("field-tested");
  }
  return {};
}

}  // namespace relief::studio
