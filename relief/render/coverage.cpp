#include "coverage.h"

#include "shaders.h"
#include "studio.h"

#include <relief/base/try.h>

#include <algorithm>

namespace relief::detail {

Result<SignedCoverage> signed_coverage(DisplayCache& cache, const DrawnLevels& detail, const Camera& camera, int width,
                                       int height) {
  /// Rows drawn at once, so that memory stays below 100 MB.
  constexpr int kPixels = 8'000'000;
  RELIEF_TRY(const GlProgram program, make_program("coverage", {kPlace, kShadowVertex}, {kCoverageFragment}));
  const Eye eye = make_eye(camera, cache.centre(), double(width) / height, cache.bounds());
  SignedCoverage total;
  const int rows = std::clamp(kPixels / width, 1, height);
  for (int y = 0; y < height; y += rows) {
    const int count = std::min(rows, height - y);
    const GlFramebuffer out = make_framebuffer();
    const GlTexture sums = attached(out, GL_COLOR_ATTACHMENT0, GL_RG32F, width, count);
    RELIEF_CHECK(complete(out));
    glBindFramebuffer(GL_FRAMEBUFFER, out);
    glViewport(0, 0, width, count);
    constexpr std::array<float, 4> kNothing{};
    glClearNamedFramebufferfv(out, GL_COLOR, 0, kNothing.data());
    const Matrix view = projection(eye, {0, double(y) / height, 1, double(y + count) / height});
    glProgramUniformMatrix4fv(program, 0, 1, GL_FALSE, view.data());
    glUseProgram(program);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    cache.draw(detail);
    glDisable(GL_BLEND);
    std::vector<float> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(count) * 2);
    glReadPixels(0, 0, width, count, GL_RG, GL_FLOAT, pixels.data());
    for (std::size_t k = 0; k < pixels.size(); k += 2) {
      total.cracks += pixels[k] != 0 ? 1 : 0;
      total.covered += pixels[k + 1] != 0 ? 1 : 0;
    }
  }
  RELIEF_CHECK(gl_status());
  return total;
}

}  // namespace relief::detail
