// Preloaded into the studio, it makes Qt throw away motions that come faster than they are handled: the negative
// control of the test that none is lost.
#include <QtCore/qcoreapplication.h>
#include <dlfcn.h>

// NOLINTNEXTLINE(readability-identifier-naming): the function of Qt that this one takes the place of
void QCoreApplication::setAttribute(Qt::ApplicationAttribute attribute, bool on) {
  using Set = void (*)(Qt::ApplicationAttribute, bool);
  static const auto next =
      reinterpret_cast<Set>(dlsym(RTLD_NEXT, "_ZN16QCoreApplication12setAttributeEN2Qt20ApplicationAttributeEb"));
  next(attribute, on || attribute == Qt::AA_CompressHighFrequencyEvents);
}
