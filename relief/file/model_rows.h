// What the writers of model files share: the facts of a model, and the rows that stand for strokes.
#pragma once

#include <relief/core/model.h>
#include <relief/file/database.h>
#include <relief/file/model_file.h>

#include <cstdint>
#include <string>

namespace relief::detail {

[[nodiscard]] const FileKind& model_kind() noexcept;

inline constexpr std::size_t kFibreBytes = 6 * sizeof(double);        ///< of a fibre in the cage, unpacked
inline constexpr std::size_t kSlabBytes = 4 * sizeof(std::uint32_t);  ///< of a slab

/// The singular facts of a model: small, rewritten as a whole, kept from damage by one checksum over all.
struct Meta {
  std::int64_t format = kFormatVersion;
  ModelInfo info;
  std::int64_t fibres = 0, slabs = 0;
  std::int64_t current = 0, last = 0;  ///< strokes: in effect; the last that can be redone
  std::string certificate;             ///< what the verifier proved when the file was made, such as "C0 C1 C3"

  [[nodiscard]] std::int64_t checksum() const;
};

/// Error: Corrupt.
[[nodiscard]] Result<Meta> read_meta(const Database& database);
/// Both inside a transaction that the caller ends.
[[nodiscard]] Status write_meta(const Database& database, const Meta& meta);
[[nodiscard]] Status write_stroke(const Database& database, const StrokeRecord& stroke, std::int64_t row_count);

}  // namespace relief::detail
