// Paths in: the CSV files that relief touch reads.
#include "commands.h"

#include <relief/base/try.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <initializer_list>
#include <span>

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

/// Hands the rows of a file of comma-separated numbers to `take(fields, line, number)`. `headers`: the ones that the
/// first line may be.
template <typename Take>
Status for_each_row(const std::filesystem::path& file, std::string_view what,
                    std::initializer_list<std::string_view> headers, Take&& take) {
  RELIEF_TRY(const std::string text, read_text(file, std::uintmax_t{4} << 30U));
  const std::string shown = printable(file.string());
  std::string wanted;
  for (const std::string_view header : headers) wanted.append(wanted.empty() ? "" : " or ").append(header);
  std::string_view columns;
  std::vector<double> values;
  std::size_t line_number = 0;
  std::string_view rest = text;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++line_number;
    if (line_number == 1) {
      const auto* const known = std::ranges::find(headers, line);
      if (known == headers.end())
        return fail(Errc::Corrupt,
                    fmt::format("{}: line 1: the header must be {}, not \"{}\"", shown, wanted, printable(line, 60)));
      columns = *known;
      values.resize(static_cast<std::size_t>(std::ranges::count(columns, ',')) + 1);
      continue;
    }
    if (line.empty() && rest.empty()) break;
    std::size_t count = 0;
    for (std::string_view left = line;; ++count) {
      const std::size_t comma = std::min(left.find(','), left.size());
      if (count < values.size() && !parse_number(left.substr(0, comma), values[count]))
        return fail(Errc::Corrupt, fmt::format("{}: line {}: \"{}\" is not a number", shown, line_number,
                                               printable(left.substr(0, comma), 60)));
      if (comma == left.size()) break;
      left.remove_prefix(comma + 1);
    }
    if (count + 1 != values.size())
      return fail(Errc::Corrupt, fmt::format("{}: line {}: {} fields, not the {} of {}", shown, line_number, count + 1,
                                             values.size(), columns));
    RELIEF_CHECK(take(std::span<const double>(values), line, line_number));
  }
  if (line_number == 0)
    return fail(Errc::Corrupt, fmt::format("{}: is empty; {} starts with the header {}", shown, what, wanted));
  return {};
}

}  // namespace

Result<std::vector<PathRow>> read_path(const std::filesystem::path& file) {
  std::vector<PathRow> rows;
  RELIEF_CHECK(for_each_row(file, "a path", {"t,x,y,z", "t,x,y,z,qw,qx,qy,qz"},
                            [&](std::span<const double> v, std::string_view line, std::size_t) -> Status {
                              PathRow& row = rows.emplace_back();
                              row.t = v[0];
                              row.position = {v[1], v[2], v[3]};
                              if (v.size() > 4) row.orientation = {v[4], v[5], v[6], v[7]};
                              std::size_t end = 0;
                              for (int k = 0; k < 4; ++k)
                                end = std::min(line.find(',', end + (k > 0 ? 1 : 0)), line.size());
                              row.text = line.substr(0, end);
                              return {};
                            }));
  return rows;
}

Result<std::vector<Vec3d>> read_tool_points(const std::filesystem::path& file) {
  std::vector<Vec3d> points;
  const std::string shown = printable(file.string());
  RELIEF_CHECK(for_each_row(
      file, "a tool", {"x,y,z"}, [&](std::span<const double> v, std::string_view, std::size_t line) -> Status {
        const Vec3d point = {v[0], v[1], v[2]};
        if (!is_finite(point)) return fail(Errc::Corrupt, fmt::format("{}: line {}: not a point", shown, line));
        if (points.size() == TouchTool::kMostPoints)
          return fail(Errc::Corrupt,
                      fmt::format("{}: line {}: a tool has at most {} points", shown, line, TouchTool::kMostPoints));
        points.push_back(point);
        return {};
      }));
  if (points.empty()) return fail(Errc::Corrupt, shown + ": has no points; a line x,y,z for each is wanted");
  return points;
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
