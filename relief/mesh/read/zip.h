// The part of the zip format that 3MF needs: reading stored and deflated members.
#pragma once

#include <relief/mesh/read/source.h>

namespace relief::detail {

struct ZipMember {
  std::string name;
  std::uint64_t offset = 0;  ///< of its local header
  std::uint64_t packed_size = 0;
  std::uint64_t size = 0;
  std::uint16_t method = 0;
  std::uint16_t flags = 0;
  std::uint32_t crc = 0;
};

class ZipArchive {
 public:
  /// Reads the list of members. Corrupt when it is damaged.
  [[nodiscard]] static Result<ZipArchive> open(const Source& source);

  /// Null when there is none; names are compared without regard to case and to a leading slash.
  [[nodiscard]] const ZipMember* find(std::string_view name) const noexcept;
  /// Unpacks one member and checks its CRC. All members together may grow to 100 times the archive plus 16 MiB, no
  /// further. A packed byte is a step. Errors: Corrupt, UnsupportedFormat, Cancelled.
  [[nodiscard]] Result<std::string> unpack(const Source& source, const ZipMember& member, Steps& steps);

 private:
  std::vector<ZipMember> members_;
  std::uint64_t unpacked_ = 0;
};

}  // namespace relief::detail
