#include <relief/base/try.h>
#include <relief/mesh/read/images.h>

#include <jpeglib.h>
#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdio>  // before jpeglib.h, which needs FILE

namespace relief::detail {
namespace {

constexpr std::uint64_t kMostAtOnce = std::uint64_t{1} << 26U;  ///< pixels held whole while decoding
constexpr std::uint64_t kMostWork = std::uint64_t{1} << 29U;    ///< pixels of all images of a mesh
constexpr std::size_t kMostImages = 256;
constexpr int kMostScans = 40;  ///< of a progressive JPEG; honest ones have about ten

std::string size_text(std::uint64_t width, std::uint64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}
std::unexpected<Error> too_large(std::uint64_t width, std::uint64_t height) {
  return fail(Errc::UnsupportedFormat, "is too large (" + size_text(width, height) + " pixels)");
}

/// Gathers rows from the top and keeps the mean of each block of `step` x `step` pixels.
class Shrinker {
 public:
  Shrinker(std::uint32_t width, std::uint32_t height, std::uint64_t most) : width_(width), height_(height) {
    while (std::uint64_t{across()} * down() > most) step_ *= 2;
    image.width = across();
    image.height = down();
    image.pixels.resize(std::size_t{image.width} * image.height);
    sums_.resize(image.width);
  }

  void add_row(const Rgba8* row) {
    if (step_ == 1) {
      std::copy_n(row, width_, image.pixels.begin() + static_cast<std::ptrdiff_t>(std::size_t{y_} * width_));
      ++y_;
      return;
    }
    for (std::uint32_t x = 0; x < width_; ++x) {
      Sum& sum = sums_[x / step_];
      sum.r += row[x].r, sum.g += row[x].g, sum.b += row[x].b;
      ++sum.count;
    }
    ++y_;
    if (y_ % step_ != 0 && y_ != height_) return;
    Rgba8* const out = image.pixels.data() + std::size_t{(y_ - 1) / step_} * image.width;
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const auto mean = [&](std::uint64_t channel) {
        return static_cast<std::uint8_t>((channel + sums_[x].count / 2) / sums_[x].count);
      };
      out[x] = {mean(sums_[x].r), mean(sums_[x].g), mean(sums_[x].b)};
      sums_[x] = {};
    }
  }

  Image image;

 private:
  struct Sum {
    std::uint64_t r = 0, g = 0, b = 0, count = 0;
  };
  [[nodiscard]] std::uint32_t across() const noexcept { return (width_ - 1) / step_ + 1; }
  [[nodiscard]] std::uint32_t down() const noexcept { return (height_ - 1) / step_ + 1; }

  std::uint32_t width_, height_;
  std::uint32_t step_ = 1;
  std::uint32_t y_ = 0;
  std::vector<Sum> sums_;
};

Result<Image> decode_png(std::string_view bytes, std::uint64_t most, std::uint64_t& work) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  struct Freed {
    png_image* image;
    ~Freed() { png_image_free(image); }
  } const freed{&header};
  const auto damaged = [&] { return fail(Errc::Corrupt, "cannot be decoded: " + printable(header.message, 100)); };
  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) return damaged();
  // What says nothing of its colour space is sRGB, also with 16 bits, which libpng would take for linear.
  header.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
  const std::uint64_t count = std::uint64_t{header.width} * header.height;
  if (count > std::min(kMostAtOnce, work)) return too_large(header.width, header.height);
  work -= count;
  header.format = PNG_FORMAT_RGBA;
  std::vector<Rgba8> pixels(count);
  if (png_image_finish_read(&header, nullptr, pixels.data(), 0, nullptr) == 0) return damaged();
  if (pixels.size() <= most) return Image{header.width, header.height, std::move(pixels)};
  Shrinker shrinker(header.width, header.height, most);
  for (std::uint32_t y = 0; y < header.height; ++y) shrinker.add_row(pixels.data() + std::size_t{y} * header.width);
  return std::move(shrinker.image);
}

/// Holds what libjpeg's jumps leave alone.
struct JpegState {
  jpeg_decompress_struct reader{};
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump{};
  std::array<char, JMSG_LENGTH_MAX> message{};
  std::string_view bytes;
  std::uint64_t most = 0, work = 0;
  bool large = false;
  std::unique_ptr<Shrinker> shrinker;
  std::vector<Rgba8> row;
};

void jpeg_failed(j_common_ptr common) {
  auto& state = *static_cast<JpegState*>(common->client_data);
  common->err->format_message(common, state.message.data());
  std::longjmp(state.jump, 1);
}
void jpeg_warned(j_common_ptr /*common*/, int /*level*/) {}
void jpeg_progressed(j_common_ptr common) {
  auto& state = *static_cast<JpegState*>(common->client_data);
  if (state.reader.input_scan_number <= kMostScans) return;
  std::snprintf(state.message.data(), state.message.size(), "it has too many scans");
  std::longjmp(state.jump, 1);
}

/// False with a message, or with `large`. No local of it has a destructor that a jump would pass over.
bool read_jpeg(JpegState& state) {
  jpeg_decompress_struct& reader = state.reader;
  if (setjmp(state.jump) != 0) return false;
  jpeg_create_decompress(&reader);
  reader.progress = &state.progress;
  jpeg_mem_src(&reader, reinterpret_cast<const unsigned char*>(state.bytes.data()), state.bytes.size());
  jpeg_read_header(&reader, TRUE);
  const std::uint64_t pixels = std::uint64_t{reader.image_width} * reader.image_height;
  state.large = pixels > state.work || (jpeg_has_multiple_scans(&reader) != 0 && pixels > kMostAtOnce);
  if (state.large) return false;
  state.work -= pixels;
  reader.out_color_space = JCS_EXT_RGBA;
  jpeg_start_decompress(&reader);
  state.shrinker = std::make_unique<Shrinker>(reader.output_width, reader.output_height, state.most);
  state.row.resize(reader.output_width);
  while (reader.output_scanline < reader.output_height) {
    auto* row = reinterpret_cast<JSAMPROW>(state.row.data());
    jpeg_read_scanlines(&reader, &row, 1);
    state.shrinker->add_row(state.row.data());
  }
  return true;
}

Result<Image> decode_jpeg(std::string_view bytes, std::uint64_t most, std::uint64_t& work) {
  const auto state = std::make_unique<JpegState>();
  state->bytes = bytes;
  state->most = most;
  state->work = work;
  state->reader.err = jpeg_std_error(&state->errors);
  state->reader.client_data = state.get();
  state->errors.error_exit = jpeg_failed;
  state->errors.emit_message = jpeg_warned;
  state->progress.progress_monitor = jpeg_progressed;
  struct Freed {
    jpeg_decompress_struct* reader;
    ~Freed() { jpeg_destroy_decompress(reader); }
  } const freed{&state->reader};
  const bool read = read_jpeg(*state);
  work = state->work;
  if (read) return std::move(state->shrinker->image);
  if (state->large) return too_large(state->reader.image_width, state->reader.image_height);
  return fail(Errc::Corrupt, "cannot be decoded: " + printable(state->message.data(), 100));
}

}  // namespace

Result<Image> decode_image(std::string_view bytes, std::uint64_t most, std::uint64_t& work) {
  if (bytes.starts_with("\x89PNG")) return decode_png(bytes, most, work);
  if (bytes.starts_with("\xff\xd8\xff")) return decode_jpeg(bytes, most, work);
  return fail(Errc::UnsupportedFormat, "is neither PNG nor JPEG");
}

std::optional<std::filesystem::path> beside(const Source& source, std::string_view relative) {
  const std::filesystem::path path = relative;
  const bool outside = path.empty() || path.is_absolute() || relative.find("://") != std::string_view::npos ||
                       relative.find('\0') != std::string_view::npos ||
                       std::ranges::any_of(path, [](const auto& part) { return part == ".."; });
  if (outside) return std::nullopt;
  return source.path.parent_path() / path;
}

ImageStore::ImageStore(const Source& source, std::size_t image_count) noexcept
    : source_(source),
      most_(std::min(kMostPixelsOfOne, kMostPixels / std::clamp<std::size_t>(image_count, 1, kMostImages))),
      bytes_left_(std::size_t{1} << 30U),
      pixels_left_(kMostWork) {}

void ImageStore::note(std::string text) {
  constexpr std::size_t kMost = 20;
  if (notes_.size() < kMost && std::ranges::find(notes_, text) == notes_.end()) notes_.push_back(std::move(text));
}

void ImageStore::note_names(std::string what, const std::vector<std::string>& names) {
  constexpr std::size_t kMostNamed = 5;
  if (names.empty()) return;
  what += ": ";
  for (std::size_t k = 0; k < std::min(names.size(), kMostNamed); ++k)
    what += (k == 0 ? "" : ", ") + printable(names[k], 40);
  if (names.size() > kMostNamed) what += " and " + std::to_string(names.size() - kMostNamed) + " more";
  note(std::move(what));
}

void ImageStore::note_rest(std::string_view rest) {
  constexpr std::string_view kNothing("\0 \t\v\f\r\n", 7);
  const std::size_t last = rest.find_last_not_of(kNothing);
  if (last == std::string_view::npos) return;
  note("it holds " + std::to_string(last + 1) + (last == 0 ? " byte" : " bytes") + " more than it declares, which " +
       (last == 0 ? "was" : "were") + " passed over");
}

std::shared_ptr<const Image> ImageStore::file(std::string_view named) {
  if (const auto known = images_.find(named); known != images_.end()) return known->second;
  std::string text(named);
  std::ranges::replace(text, '\\', '/');
  std::error_code ignored;
  auto path = beside(source_, text);
  if (!path || !std::filesystem::exists(*path, ignored))
    path = beside(source_, std::filesystem::path(text).filename().string());
  if (path) {
    const auto size = std::filesystem::file_size(*path, ignored);
    if (!ignored && size <= bytes_left_) {
      if (const auto bytes = source_.read_other(*path)) {
        bytes_left_ -= bytes->size;
        return decoded(std::string(named), bytes->view());
      }
    }
  }
  note("image '" + printable(named, 120) + "' is not beside the mesh or cannot be read; its surface is plain");
  return images_[std::string(named)] = nullptr;
}

std::shared_ptr<const Image> ImageStore::inside(std::string_view key, std::string_view bytes) {
  if (const auto known = images_.find(key); known != images_.end()) return known->second;
  return decoded(std::string(key), bytes);
}

std::shared_ptr<const Image> ImageStore::decoded(const std::string& key, std::string_view bytes) {
  std::shared_ptr<const Image> image;
  if (images_.size() >= kMostImages)
    note("there are more than " + std::to_string(kMostImages) + " images; the surface of the others is plain");
  else if (auto made = decode_image(bytes, most_, pixels_left_))
    image = std::make_shared<const Image>(*std::move(made));
  else
    note("image '" + printable(key, 120) + "' " + made.error().message + "; its surface is plain");
  return images_[key] = image;
}

}  // namespace relief::detail
