// A film of the model on a turntable, as numbered pictures.
#pragma once

#include <relief/render/frame.h>

#include <QString>
#include <atomic>
#include <functional>

namespace relief::studio {

struct Turntable {
  QString folder;        ///< is there
  QString stem;          ///< "head" gives head-0001.png and so on
  int frames = 72;       ///< 1..9999
  double degrees = 360;  ///< all the way from the first frame to the one after the last; negative: the other way round
  double seconds = 3;    ///< that the film takes, > 0
  int width = 1920, height = 1080;
};

/// Name of frame k, from 0 on.
[[nodiscard]] QString frame_file(const Turntable& film, int k);
/// Draws each frame as a final one, turned around the camera's up axis, and writes STEM.ffconcat beside them, which
/// ffmpeg reads as a film of that many seconds. `told` hears how many frames are done. One thread with a renderer of
/// its own; a final frame takes as long as a picture by F12. Errors: those of the renderer; Io; Cancelled. Then no file
/// of it is left, and an older film of that name is as it was.
[[nodiscard]] Status draw_turntable(const Snapshot& model, const Frame& first, const Turntable& film,
                                    const std::function<void(int)>& told, const std::atomic<bool>& cancel);

}  // namespace relief::studio
