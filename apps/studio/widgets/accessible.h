// What a widget is to assistive tools, where Qt cannot guess it from the class.
#pragma once

#include <QAccessible>

class QWidget;

namespace relief::studio {

/// To be called first in the constructor: what has once been told to assistive tools, a name for example, fixes the
/// role. UI thread.
void set_accessible_role(QWidget* widget, QAccessible::Role role);

/// Sets the description and tells assistive tools, if it differs.
void describe(QWidget* widget, const QString& words);

}  // namespace relief::studio
