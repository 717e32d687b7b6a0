// Icons by name, drawn in the colours of the theme in use.
#pragma once

#include <QIcon>
#include <QStringList>

namespace relief::studio {

/// The icon of a tool (by the id of its ToolInfo) or of a command ("undo", "open", ...): normal in text colour with the
/// tool in accent, checked in the colour of text on accent, disabled faint. It follows the theme and is sharp at every
/// size. An id without a picture gives its first letter.
[[nodiscard]] QIcon icon(QStringView id);
[[nodiscard]] bool has_icon(QStringView id);
/// Ids of all pictures, sorted.
[[nodiscard]] QStringList icon_ids();

/// The same picture in one colour, for marks beside text that has that colour. `side` in device-independent pixels.
[[nodiscard]] QPixmap icon_pixmap(QStringView id, int side, const QColor& colour, double pixel_ratio = 1);

}  // namespace relief::studio
