#include <relief/convert/failures.h>
#include <relief/convert/report.h>
#include <relief/convert/support/words.h>

#include <cmath>
#include <string_view>

namespace relief::detail {

std::unexpected<Error> outside_range(Setting setting, double value, Range range) {
  const bool is_count =
      setting == Setting::Slabs || setting == Setting::Intervals || setting == Setting::ColourIntervals;
  const auto say_number = [&](double x) { return is_count ? std::to_string(std::llround(x)) : number(x); };
  const auto say = [&](std::string_view what, std::string_view zero) {
    return fail(Errc::InvalidArgument, std::string(what) + " is " + say_number(value) + "; it must be " +
                                           std::string(zero) + say_number(range.least) + " to " +
                                           say_number(range.most) + (is_count ? "." : ", a share of the diagonal."));
  };
  switch (setting) {
    case Setting::Slabs:
      return say("the number of slabs", "");
    case Setting::Intervals:
      return say("the number of intervals per edge", "0 (chosen per slab) or ");
    case Setting::Error:
      return say("the error", "");
    case Setting::ColourIntervals:
      return say("the number of colour intervals per edge", "0 (chosen for the colours) or ");
    case Setting::Voxel:
      return say("the voxel to remesh with", "0 (chosen from the source) or ");
    case Setting::Thickness:
      break;
  }
  return say("the thickness", "");
}

std::unexpected<Error> cancelled(Work work) {
  switch (work) {
    case Work::Conversion:
      return fail(Errc::Cancelled, "conversion was cancelled.");
    case Work::Remesh:
      return fail(Errc::Cancelled, "remeshing was cancelled.");
    case Work::Room:
      return fail(Errc::Cancelled, "making room was cancelled.");
    case Work::Other:
      break;
  }
  return fail(Errc::Cancelled, "cancelled");
}

std::unexpected<Error> no_mode_to_convert_to() {
  return fail(Errc::InvalidArgument, "preview is no mode to convert to; it must be certified or tolerant.");
}

std::unexpected<Error> not_enough_memory(std::size_t triangles, int slabs) {
  return fail(Errc::InvalidArgument, "there is not enough memory for " + std::to_string(triangles) + " triangles and " +
                                         std::to_string(slabs) + " slabs; use fewer --slabs.");
}

std::unexpected<Error> too_far_from_the_origin(double farthest, double across) {
  return fail(Errc::Corrupt, "the source lies " + number(farthest) + " from the origin, and its triangles, " +
                                 number(across) + " across, are too small for that; move it nearer to the origin.");
}

std::unexpected<Error> size_out_of_bounds(double across, Range range) {
  return fail(Errc::Corrupt, "the source is " + number(across) +
                                 " across; coordinates of this size cannot be computed with; scale it to between " +
                                 number(range.least) + " and " + number(range.most) + ".");
}

std::unexpected<Error> certified_something_else(const ConvertReport& report) {
  return fail(Errc::Unfoldable, not_of_the_source(report) + "; " + remedy(Mode::Certified, true) + ".");
}

std::unexpected<Error> voxels_too_small(double least) {
  return fail(Errc::InvalidArgument, "the voxels to remesh with are too small; this source can take " +
                                         std::to_string(std::ceil(least * 1e6) / 1e6) + " of its diagonal or more.");
}

std::unexpected<Error> nothing_as_large_as_voxels() {
  return fail(Errc::Corrupt, "nothing of the source is as large as the voxels; use a smaller --remesh=VOXEL.");
}

std::unexpected<Error> no_room(NoRoom why) {
  switch (why) {
    case NoRoom::OtherCage:
      return fail(Errc::Corrupt, "the room was made for another cage.");
    case NoRoom::OtherModel:
      return fail(Errc::Corrupt, "the room was made for another model.");
    case NoRoom::NoNumbers:
      break;
  }
  return fail(Errc::InvalidArgument,
              "the solids that want room, or the goals for it, are not numbers that make sense.");
}

std::string why_not_proved(const std::string& reason) { return "the verifier refused the shell: " + reason; }

std::string why_not_tested(verify::Condition condition) {
  return std::string(verify::name(condition)) + " could not be tested";
}

std::string no_reason() { return "no reason given"; }

std::string fault_of_tiles(Layer layer, const std::string& what) {
  return "the tiles of " + std::string(name(layer)) + ": " + what;
}

std::unexpected<Error> not_written(const std::filesystem::path& file) {
  return fail(Errc::Cancelled, printable(file.string()) + ": not written, as the export was cancelled");
}

std::unexpected<Error> slabs_refused(const std::string& reason, Mode next, bool is_remeshed) {
  return fail(Errc::Unfoldable, "the verifier refused the slabs: " + reason + "; " + remedy(next, is_remeshed) + ".");
}

std::unexpected<Error> samples_refused(const std::string& reason) {
  return fail(Errc::Unfoldable, "the verifier refused the samples: " + reason +
                                    "; this is a fault of Relief's, which other --samples may avoid.");
}

}  // namespace relief::detail
