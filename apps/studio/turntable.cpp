#include "turntable.h"

#include "camera_control.h"
#include "picture_of.h"
#include "text.h"

#include <relief/base/try.h>

#include <QSaveFile>
#include <QTemporaryDir>
#include <filesystem>
#include <numbers>
#include <vector>

namespace relief::studio {

namespace {

QString list_file(const Turntable& film) { return QStringLiteral("%1/%2.ffconcat").arg(film.folder, film.stem); }

/// ffmpeg's list of files, each with the time that it is seen (https://ffmpeg.org/ffmpeg-formats.html#concat-1).
Status write_list(const Turntable& film) {
  QByteArray words = "ffconcat version 1.0\n";
  for (int k = 0; k < film.frames; ++k) {
    const QString name =
        frame_file(film, k).section(QLatin1Char('/'), -1).replace(QLatin1String("'"), QLatin1String("'\\''"));
    words += "file '" + name.toUtf8() + "'\nduration " + QByteArray::number(film.seconds / film.frames, 'f', 6) + '\n';
  }
  QSaveFile out(list_file(film));
  if (out.open(QIODevice::WriteOnly) && out.write(words) == words.size() && out.commit()) return {};
  return fail(Errc::Io, list_file(film).toStdString() + ": " + out.errorString().toStdString());
}

Status move_over(const QString& from, const QString& to) {
  std::error_code error;
  std::filesystem::rename(path(from), path(to), error);
  if (error) return fail(Errc::Io, to.toStdString() + ": " + error.message());
  return {};
}

Status draw_frames(const Snapshot& model, const Frame& first, const Turntable& film,
                   const std::function<void(int)>& told, const std::atomic<bool>& cancel) {
  RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
  Frame frame = first;
  frame.width = film.width;
  frame.height = film.height;
  for (int k = 0; k < film.frames; ++k) {
    // To the bit: the first picture is the view itself.
    frame.camera =
        k == 0 ? first.camera : orbit(first.camera, film.degrees * k / film.frames * std::numbers::pi / 180, 0, true);
    RELIEF_TRY(const Picture picture, renderer.picture(model, frame, &cancel));
    RELIEF_CHECK(save_png(picture, path(frame_file(film, k))));
    told(k + 1);
  }
  return write_list(film);
}

}  // namespace

QString frame_file(const Turntable& film, int k) {
  return QStringLiteral("%1/%2-%3.png").arg(film.folder, film.stem).arg(k + 1, 4, 10, QLatin1Char('0'));
}

Status draw_turntable(const Snapshot& model, const Frame& first, const Turntable& film,
                      const std::function<void(int)>& told, const std::atomic<bool>& cancel) {
  // Aside first, so that an older film of this name is whole until the new one is.
  const QTemporaryDir aside(film.folder + QStringLiteral("/.turntable-XXXXXX"));
  if (!aside.isValid()) return fail(Errc::Io, film.folder.toStdString() + ": " + aside.errorString().toStdString());
  Turntable hidden = film;
  hidden.folder = aside.path();
  RELIEF_CHECK(draw_frames(model, first, hidden, told, cancel));
  for (int k = 0; k < film.frames; ++k) RELIEF_CHECK(move_over(frame_file(hidden, k), frame_file(film, k)));
  return move_over(list_file(hidden), list_file(film));
}

}  // namespace relief::studio
