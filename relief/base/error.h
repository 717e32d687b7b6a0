// How a function says that the world failed: a code for programs, a sentence for people.
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>
#include <utility>

namespace relief {

enum class Errc : std::uint8_t {
  InvalidArgument,
  NotFound,
  Io,
  Corrupt,
  UnsupportedFormat,
  NewerVersion,
  NotManifold,
  Unfoldable,
  DeviceUnavailable,
  DeviceLost,
  Cancelled,
};

/// Returns the name of the code as it stands in the enumeration.
[[nodiscard]] std::string_view name(Errc code) noexcept;

/// One failure. The message is a single sentence that names the file, the place in it and the remedy.
struct Error {
  Errc code;            ///< the kind of failure, for the program
  std::string message;  ///< one sentence for people: the file, the place, the remedy
};

template <typename T>
using Result = std::expected<T, Error>;
using Status = Result<void>;

/// `return fail(Errc::Io, "...")` from any function that returns a Result.
[[nodiscard]] inline std::unexpected<Error> fail(Errc code, std::string message) {
  return std::unexpected(Error{.code = code, .message = std::move(message)});
}

/// Text that comes from outside (names, parts of files), fit for one line of a terminal: control characters and bytes
/// that are not UTF-8 become \xNN, and what is longer than `limit` bytes is cut with "...".
[[nodiscard]] std::string printable(std::string_view text, std::size_t limit = 200);

/// Errc::Io: "FILE: what: why", the reason being the system's for `error` (errno); the name is made printable.
[[nodiscard]] std::unexpected<Error> io_error(std::string_view file, std::string_view what, int error);

}  // namespace relief
