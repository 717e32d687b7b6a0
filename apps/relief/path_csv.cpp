// Paths in, forces out: the CSV files of relief touch.
#include "commands.h"

#include <relief/base/try.h>

#include <fmt/format.h>

#include <array>
#include <charconv>

namespace relief::cli {

namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

/// A decimal number, nan or inf, the whole field; a number too large for a double becomes infinite, one too small zero.
bool parse_number(std::string_view field, double& value) {
  field = trimmed(field);
  if (!field.empty() && field.front() == '+') field.remove_prefix(1);
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error == std::errc::result_out_of_range && end == field.data() + field.size()) {
    const bool negative = field.front() == '-';
    const std::size_t exponent = field.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && exponent + 1 < field.size() && field[exponent + 1] == '-';
    value = tiny ? 0 : negative ? -HUGE_VAL : HUGE_VAL;
    return true;
  }
  return error == std::errc{} && end == field.data() + field.size() && !field.empty();
}

}  // namespace

Result<std::vector<PathRow>> read_path(const std::filesystem::path& file) {
  RELIEF_TRY(const std::string text, read_text(file, std::uintmax_t{4} << 30U));
  const std::string shown = printable(file.string());
  std::vector<PathRow> rows;
  std::size_t line_number = 0;
  std::string_view rest = text;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++line_number;
    if (line_number == 1) {
      if (line != "t,x,y,z")
        return fail(Errc::Corrupt,
                    fmt::format("{}: line 1: the header must be t,x,y,z, not \"{}\"", shown, printable(line, 60)));
      continue;
    }
    if (line.empty() && rest.empty()) break;
    std::array<double, 4> values{};
    std::size_t count = 0;
    for (std::string_view left = line;; ++count) {
      const std::size_t comma = std::min(left.find(','), left.size());
      if (count < 4 && !parse_number(left.substr(0, comma), values[count]))
        return fail(Errc::Corrupt, fmt::format("{}: line {}: \"{}\" is no number", shown, line_number,
                                               printable(left.substr(0, comma), 60)));
      if (comma == left.size()) break;
      left.remove_prefix(comma + 1);
    }
    if (count + 1 != 4)
      return fail(Errc::Corrupt,
                  fmt::format("{}: line {}: {} fields, not the 4 of t,x,y,z", shown, line_number, count + 1));
    rows.push_back({values[0], {values[1], values[2], values[3]}, std::string(line)});
  }
  if (line_number == 0) return fail(Errc::Corrupt, shown + ": is empty; a path starts with the header t,x,y,z");
  return rows;
}

std::string_view force_header() noexcept {
  return "t,x,y,z,contact,slab,u,v,alpha,depth,px,py,pz,nx,ny,nz,fx,fy,fz,flags\n";
}

std::string force_row(const ServoSample& s, std::string_view echo) {
  const SlabCoord at = s.contact ? s.at : SlabCoord{};
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", echo, s.contact ? 1 : 0,
                     s.contact ? static_cast<std::int64_t>(at.slab) : -1, at.u, at.v, at.alpha,
                     s.contact ? s.depth : 0.0, s.contact_point.x, s.contact_point.y, s.contact_point.z, s.normal.x,
                     s.normal.y, s.normal.z, s.force.x, s.force.y, s.force.z, s.flags);
}

Result<Vec3d> parse_vector(std::string_view option, std::string_view text) {
  std::array<double, 3> values{};
  std::size_t count = 0;
  for (std::string_view left = text;; ++count) {
    const std::size_t comma = std::min(left.find(','), left.size());
    if (count >= 3 || !parse_number(left.substr(0, comma), values[count]) || !std::isfinite(values[count])) {
      count = 0;
      break;
    }
    if (comma == left.size()) break;
    left.remove_prefix(comma + 1);
  }
  if (count != 2)
    return fail(Errc::InvalidArgument,
                fmt::format("{} takes three numbers x,y,z, not \"{}\"", option, printable(text, 60)));
  return Vec3d{values[0], values[1], values[2]};
}

}  // namespace relief::cli
