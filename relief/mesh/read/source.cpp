#include <relief/mesh/read/source.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <limits>

namespace relief::detail {

Result<FileBytes> read_file(const std::filesystem::path& file, const Progress& progress) {
  const std::string name = printable(file.string());
  const auto io = [&](int code) {
    if (code == ENOENT || code == ENOTDIR) return fail(Errc::NotFound, name + ": no such file");
    return fail(Errc::Io, name + ": cannot be read: " + std::generic_category().message(code));
  };
  // Non-blocking, so that opening a pipe cannot wait for its writer.
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return io(errno);
  struct Closer {
    int descriptor;
    ~Closer() { ::close(descriptor); }
  } const closer{descriptor};

  struct stat status{};
  if (::fstat(descriptor, &status) != 0) return io(errno);
  if (S_ISDIR(status.st_mode)) return fail(Errc::Io, name + ": is a folder");
  if (!S_ISREG(status.st_mode)) return fail(Errc::Io, name + ": is not a regular file");
  FileBytes bytes;
  const auto size = static_cast<std::size_t>(status.st_size);
  bytes.data = std::make_unique_for_overwrite<char[]>(size);
  Steps steps(progress, kImport, size, 0, kReadShare);
  constexpr std::size_t kAtOnce = std::size_t{1} << 23U;  // bytes: some milliseconds of a disk
  while (bytes.size < size) {
    if (!steps.reached(bytes.size)) return fail(Errc::Cancelled, name + ": " + std::string(kReadingCancelled));
    const ssize_t got = ::read(descriptor, bytes.data.get() + bytes.size, std::min(size - bytes.size, kAtOnce));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return io(errno);
    if (got == 0) break;  // shortened meanwhile; the reader sees what is left
    bytes.size += static_cast<std::size_t>(got);
  }
  return bytes;
}

namespace {

bool ends_value(const char* at, const char* end) noexcept {
  return at == end || *at == ' ' || *at == '\t' || *at == '\n' || *at == '\r' || *at == '#' || *at == '\\' ||
         *at == '\v' || *at == '\f';
}

}  // namespace

bool TextCursor::number(double& value) noexcept {
  skip_blanks();
  const char* from = at_;
  if (from != end_ && *from == '+' && from + 1 != end_ && from[1] != '-') ++from;
  const auto [stop, code] = std::from_chars(from, end_, value);
  if (code == std::errc::invalid_argument) return false;
  if (code == std::errc::result_out_of_range) {
    // from_chars does not say which side it left the range on: a negative exponent, or none and a leading zero, is too
    // small.
    const std::string_view text(from, static_cast<std::size_t>(stop - from));
    const std::size_t e = text.find_first_of("eE");
    const std::string_view digits = text.starts_with('-') ? text.substr(1) : text;
    const bool small = e != std::string_view::npos ? text.substr(e + 1).starts_with('-') : digits.starts_with('0');
    const double size = small ? 0.0 : std::numeric_limits<double>::infinity();
    value = text.starts_with('-') ? -size : size;
  }
  if (ends_value(stop, end_) &&
      !(stop != end_ && *stop == '#' && stop + 1 != end_ && std::isalpha(static_cast<unsigned char>(stop[1])) != 0)) {
    at_ = stop;
    return true;
  }
  // Old Microsoft libraries print 1.#INF, -1.#IND, 1.#QNAN.
  if (stop == end_ || *stop != '#') return false;
  const char* tail = stop + 1;
  while (tail != end_ && std::isalpha(static_cast<unsigned char>(*tail)) != 0) ++tail;
  const std::string_view word(stop + 1, static_cast<std::size_t>(tail - stop - 1));
  if (!ends_value(tail, end_) || (word != "INF" && word != "IND" && word != "QNAN" && word != "SNAN")) return false;
  value = word == "INF" ? std::copysign(std::numeric_limits<double>::infinity(), value)
                        : std::numeric_limits<double>::quiet_NaN();
  at_ = tail;
  return true;
}

bool TextCursor::integer(std::int64_t& value, bool real) noexcept {
  skip_blanks();
  const char* from = at_;
  if (from != end_ && *from == '+' && from + 1 != end_ && from[1] != '-') ++from;
  const auto [stop, code] = std::from_chars(from, end_, value);
  if (code == std::errc() && !(real && stop != end_ && (*stop == '.' || *stop == 'e' || *stop == 'E'))) {
    if (real && !ends_value(stop, end_)) return false;
    at_ = stop;
    return true;
  }
  if (!real) return false;
  const char* const before = at_;
  double number_value = 0.0;
  if (!number(number_value)) return false;
  if (!(std::abs(number_value) < 9e15) || std::trunc(number_value) != number_value) {
    at_ = before;
    return false;
  }
  value = static_cast<std::int64_t>(number_value);
  return true;
}

std::string TextCursor::peek() const {
  TextCursor copy = *this;
  const std::string_view text = copy.word();
  if (text.empty()) return "nothing";
  std::string quoted = "'";
  quoted += printable(text, 40);
  quoted += "'";
  return quoted;
}

void FaceSink::add(std::span<const std::uint32_t> corners, std::size_t place, const FacePaint& paint) {
  if (corners.size() < 3) return leave_out_line();
  std::uint32_t highest = 0;
  for (const std::uint32_t corner : corners) highest = std::max(highest, corner);
  if (highest > highest_) {
    highest_ = highest;
    highest_place_ = place;
  }
  if (corners.size() == 3) {
    mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
    if (paint.material != 0) {
      mesh_.material_of.resize(mesh_.triangles.size(), 0);
      mesh_.material_of.back() = paint.material;
    }
    if (!paint.uvs.empty()) {
      uvs_.resize(mesh_.triangles.size(), {kNoUv, kNoUv, kNoUv});
      uvs_.back() = {paint.uvs[0], paint.uvs[1], paint.uvs[2]};
    }
  } else {
    polygons_.push_back(static_cast<std::uint32_t>(corners.size()));
    polygons_.push_back(paint.material);
    if (!paint.uvs.empty()) {
      polygon_uvs_.resize(polygons_.size(), kNoUv);
      polygon_uvs_.insert(polygon_uvs_.end(), paint.uvs.begin(), paint.uvs.end());
    }
    polygons_.insert(polygons_.end(), corners.begin(), corners.end());
  }
}

Status FaceSink::finish(const Source& source, std::string_view unit, std::uint32_t first) {
  if (mesh_.triangles.empty() && polygons_.empty()) {
    return source.error(Errc::UnsupportedFormat, mesh_.positions.empty()
                                                     ? std::string("holds no faces")
                                                     : "holds " + std::to_string(mesh_.positions.size()) +
                                                           " points but no faces; a surface is needed");
  }
  if (highest_ >= mesh_.positions.size()) {
    return source.corrupt(unit, highest_place_,
                          "a face names vertex " + std::to_string(std::uint64_t{highest_} + first) +
                              (first == 0 ? " (counted from 0)" : "") + " of " +
                              std::to_string(mesh_.positions.size()));
  }
  PolygonCutter cutter(400'000'000);
  Steps steps(source.progress, kImport, polygons_.size(), kParsedShare, 1);
  mesh_.triangles.reserve(mesh_.triangles.size() + polygons_.size() / 2);
  for (std::size_t k = 0; k < polygons_.size();) {
    const std::size_t count = polygons_[k];
    const std::uint32_t material = polygons_[k + 1];
    const auto corners = std::span(polygons_).subspan(k + 2, count);
    const std::size_t before = mesh_.triangles.size();
    if (!cutter.cut(corners, mesh_.positions, mesh_.triangles, source.progress)) {
      if (source.progress.cancelled()) return source.cancelled();
      return source.error(Errc::UnsupportedFormat,
                          "its polygons are too large and intricate to cut; export it with triangles instead");
    }
    if (material != 0) {
      mesh_.material_of.resize(before, 0);
      mesh_.material_of.resize(mesh_.triangles.size(), material);
    }
    const bool has_uvs = k + 2 < polygon_uvs_.size() && polygon_uvs_[k + 2] != kNoUv;
    if (has_uvs) uvs_.resize(before, {kNoUv, kNoUv, kNoUv});
    for (std::size_t t = before; t < mesh_.triangles.size(); ++t) {
      Triangle& places = mesh_.triangles[t];
      if (has_uvs) {
        const std::uint32_t* const uvs = polygon_uvs_.data() + k + 2;
        uvs_.push_back({uvs[places[0]], uvs[places[1]], uvs[places[2]]});
      }
      for (std::uint32_t& corner : places) corner = corners[corner];
    }
    k += count + 2;
    if (!steps.reached(k)) return source.cancelled();
  }
  if (mesh_.triangles.empty()) return source.corrupt("every face has fewer than three different corners");
  if (!mesh_.material_of.empty()) mesh_.material_of.resize(mesh_.triangles.size(), 0);
  if (!uvs_.empty()) uvs_.resize(mesh_.triangles.size(), {kNoUv, kNoUv, kNoUv});
  return {};
}

int PolygonCutter::turn(const Corner& corner) const noexcept {
  return orientation(ring_[corner.before].at, corner.at, ring_[corner.after].at);
}

bool PolygonCutter::is_ear(const Corner& corner) noexcept {
  const Point2 a = ring_[corner.before].at;
  const Point2 b = corner.at;
  const Point2 c = ring_[corner.after].at;
  const auto same = [](Point2 p, Point2 q) { return p.x == q.x && p.y == q.y; };
  spend(reflex_.size() + 1);
  return std::ranges::none_of(reflex_, [&](std::uint32_t k) {
    const Corner& other = ring_[k];
    if (!other.reflex) return false;
    const Point2 p = other.at;
    if (same(p, a) || same(p, b) || same(p, c)) return false;
    return orientation(a, b, p) >= 0 && orientation(b, c, p) >= 0 && orientation(c, a, p) >= 0;
  });
}

bool PolygonCutter::cut(std::span<const std::uint32_t> polygon, std::span<const Vec3d> positions,
                        std::vector<Triangle>& out, const Progress& progress) {
  ring_.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    if (polygon[k] != polygon[k == 0 ? polygon.size() - 1 : k - 1])
      ring_.push_back({{}, static_cast<std::uint32_t>(k), 0, 0, false});
  }
  const std::size_t count = ring_.size();
  spend(count);
  if (budget_ == 0) return false;
  if (count < 3) return true;
  const auto vertex = [&](std::size_t k) { return polygon[ring_[k].place]; };
  const auto put = [&](std::size_t a, std::size_t b, std::size_t c) {
    out.push_back({ring_[a].place, ring_[b].place, ring_[c].place});
  };
  const auto fan = [&] {
    for (std::size_t k = 1; k + 1 < count; ++k) put(0, k, k + 1);
    return true;
  };
  if (count == 3) return fan();

  // The plane by Newell's sum; the coordinates are kept exactly and only the axis that it faces most is dropped.
  const Vec3d origin = positions[vertex(0)];
  Vec3d normal;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    normal += cross(positions[vertex(k)] - origin, positions[vertex(k + 1)] - origin);
  }
  if (!is_finite(normal) || normal == Vec3d{}) return fan();
  const Vec3d size = {std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
  const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3d p = positions[vertex(k)];
    if (!is_finite(p)) return fan();
    const double x = p[(axis + 1) % 3];
    const double y = p[(axis + 2) % 3];
    ring_[k].at = normal[axis] > 0.0 ? Point2{x, y} : Point2{y, x};
    ring_[k].before = static_cast<std::uint32_t>(k == 0 ? count - 1 : k - 1);
    ring_[k].after = static_cast<std::uint32_t>(k + 1 == count ? 0 : k + 1);
  }
  reflex_.clear();
  for (std::uint32_t k = 0; k < count; ++k) {
    ring_[k].reflex = turn(ring_[k]) <= 0;
    if (ring_[k].reflex) reflex_.push_back(k);
  }
  if (count == 4) {
    const auto sound = [&](std::size_t a, std::size_t b, std::size_t c) {
      return orientation(ring_[a].at, ring_[b].at, ring_[c].at) > 0;
    };
    const auto length2 = [&](std::size_t a, std::size_t b) {
      const Vec3d d = positions[vertex(b)] - positions[vertex(a)];
      return dot(d, d);
    };
    const bool first = sound(0, 1, 2) && sound(0, 2, 3);
    const bool second = sound(1, 2, 3) && sound(1, 3, 0);
    if (first && (!second || length2(0, 2) <= length2(1, 3))) return fan();
    if (second) {
      put(1, 2, 3);
      put(1, 3, 0);
      return true;
    }
  }

  std::size_t left = count;
  std::size_t without = 0;  // corners looked at since the last ear
  bool force = false;       // a whole round found none: the polygon crosses itself or what is left is flat
  std::uint32_t at = 0;
  while (left > 3) {
    Corner& corner = ring_[at];
    const int turned = turn(corner);
    if (budget_ == 0 || progress.cancelled()) return false;
    if (turned > 0 ? force || is_ear(corner) : force && without >= left) {
      put(corner.before, at, corner.after);
      corner.reflex = false;
      ring_[corner.before].after = corner.after;
      ring_[corner.after].before = corner.before;
      for (const std::uint32_t k : {corner.before, corner.after}) {
        if (ring_[k].reflex && turn(ring_[k]) > 0) ring_[k].reflex = false;
      }
      if (reflex_.size() > 32 && left % 32 == 0) {
        std::erase_if(reflex_, [&](std::uint32_t k) { return !ring_[k].reflex; });
      }
      --left;
      without = 0;
      force = false;
      at = ring_[corner.after].after;
    } else {
      spend(1);
      ++without;
      if (without >= left && !force) {
        force = true;
        without = 0;
      }
      at = corner.after;
    }
  }
  put(ring_[at].before, at, ring_[at].after);
  return true;
}

}  // namespace relief::detail
