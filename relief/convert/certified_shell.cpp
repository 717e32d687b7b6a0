#include <relief/base/free_memory.h>
#include <relief/convert/certified_shell.h>
#include <relief/convert/shell/partition.h>
#include <relief/convert/support/paged.h>

#include <optional>
#include <utility>

namespace relief::detail {

CertifiedShell build_certified(ClosedSource given, const CertifiedSettings& settings, const Progress& progress) {
  CertifiedShell result;
  result.prepared = prepare(std::move(given), settings.limits, progress);
  std::optional<InitialStand> start = std::exchange(result.prepared.stand, std::nullopt);
  if (!start) return result;
  ClosedSource& source = result.prepared.source;
  const bool is_large = source.faces.size() > kLarge;
  free_memory(start->source.point_of, start->source.face_of, start->source.most_slack);
  Paged<ClosedSource> prepared(std::move(source), settings.pages);  // the same points and faces in another order
  prepared.rest();
  Partition partition(start->source, std::move(start->ends), std::move(start->tree), settings.target,
                      settings.limits.longest);
  if (!partition.reduce(progress)) return result;
  constexpr std::size_t kFar = 8;  // times the target: from there it takes long and leads nowhere near
  constexpr double kNear = 2.5;    // the same: from there little would have to be very much
  bool folds = false;              // before anything was lost
  bool too_much = false;           // was lost
  for (const Tolerance& tolerance : settings.tolerances) {
    const std::size_t before = partition.slab_count();
    if (before <= settings.target) break;
    const bool gives_up = tolerance.folds > 0;
    const bool loses = tolerance.loss > 0;
    if (loses && (settings.most_lost == 0 || is_large || double(before) > kNear * double(settings.target))) break;
    if (!gives_up && (is_large || before > kFar * settings.target)) continue;
    if (loses && !partition.has_kept()) {
      partition.keep();
      folds = result.tolerant;
    }
    if (!partition.reduce_further(tolerance, progress)) return result;
    result.tolerant = result.tolerant || (gives_up && partition.slab_count() < before);
    too_much = loses && partition.lost() > settings.most_lost;
    if (too_much) break;
  }
  if (partition.has_kept() && (partition.slab_count() > settings.target || too_much)) {
    partition.go_back();
    result.tolerant = folds;
  }
  if (!partition.thicken(settings.longest, progress)) return result;
  result.shell = std::move(partition).shell();
  start.reset();
  source = std::move(prepared).take();
  return result;
}

}  // namespace relief::detail
