#include <relief/mesh/read/inflate.h>

#include <zlib.h>

#include <algorithm>
#include <new>

namespace relief::detail {
namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b";

class Stream {
 public:
  Stream(std::string_view packed, Wrapper wrapper) : unread_(packed) {
    constexpr int kLargestWindow = 15, kWithGzip = 16;
    if (inflateInit2(&stream_, wrapper == Wrapper::Gzip ? kLargestWindow + kWithGzip : -kLargestWindow) != Z_OK)
      throw std::bad_alloc();
  }
  ~Stream() { inflateEnd(&stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Appends up to `room` bytes to `out`.
  int step(std::size_t room, std::string& out) {
    feed();
    const std::size_t have = out.size();
    out.resize(have + room);
    stream_.next_out = reinterpret_cast<Bytef*>(out.data() + have);
    stream_.avail_out = static_cast<uInt>(room);
    const int code = inflate(&stream_, Z_NO_FLUSH);
    out.resize(have + room - stream_.avail_out);
    return code == Z_BUF_ERROR && stream_.avail_in == 0 && !unread_.empty() ? Z_OK : code;
  }
  /// After the end of a gzip member: whether another begins, which step() then goes on with.
  bool next_member() {
    const std::string_view rest(unread_.data() - stream_.avail_in, unread_.size() + stream_.avail_in);
    return rest.starts_with(kGzipMagic) && inflateReset(&stream_) == Z_OK;
  }

  /// Returns how many packed bytes are not used yet.
  [[nodiscard]] std::size_t left() const noexcept { return unread_.size() + stream_.avail_in; }

 private:
  void feed() {
    constexpr std::size_t kMostAtOnce = std::size_t{1} << 30U;  // zlib counts in 32 bits
    if (stream_.avail_in != 0 || unread_.empty()) return;
    const std::size_t size = std::min(unread_.size(), kMostAtOnce);
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(unread_.data()));  // zlib does not write there
    stream_.avail_in = static_cast<uInt>(size);
    unread_.remove_prefix(size);
  }

  z_stream stream_{};
  std::string_view unread_;
};

}  // namespace

Inflated inflate_all(std::string_view packed, Wrapper wrapper, std::uint64_t most, std::string& out, Steps& steps) {
  // Bytes; the most take some 30 ms.
  constexpr std::size_t kLeastStep = std::size_t{1} << 16U, kMostStep = std::size_t{1} << 23U;
  Stream stream(packed, wrapper);
  int code = Z_OK;
  while (code == Z_OK) {
    if (out.size() > most) return Inflated::TooLarge;
    if (!steps.reached(packed.size() - stream.left())) return Inflated::Cancelled;
    code = stream.step(std::clamp(out.size(), kLeastStep, kMostStep), out);
    if (code == Z_STREAM_END && wrapper == Wrapper::Gzip && stream.next_member()) code = Z_OK;
  }
  return code == Z_STREAM_END ? Inflated::Whole : Inflated::Damaged;
}

}  // namespace relief::detail
