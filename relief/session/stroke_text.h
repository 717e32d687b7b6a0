// Strokes as text: what a strokes file holds, and what the journal keeps of each stroke.
#pragma once

#include <relief/base/error.h>
#include <relief/edit/stroke.h>

#include <string>
#include <string_view>
#include <vector>

namespace relief {

/// Returns one stroke as a JSON object in one line; what has its default is left out. Reading it gives the same bits
/// back, as long as all numbers are finite. The label must be UTF-8.
[[nodiscard]] std::string text_of(const Stroke& stroke);

/// Returns the same as the journal keeps it: with "limited", the samples that would have gone beyond their fibre's
/// ends, where there were any. It is passed over where the stroke is read.
[[nodiscard]] std::string journal_text(const Stroke& stroke, const StrokeResult& result);

/// Returns the stroke that a JSON object holds. `place` begins each sentence, such as "a.json: stroke 3". Error:
/// Corrupt, with the field that is missing, unknown or out of its range.
[[nodiscard]] Result<Stroke> stroke_of(std::string_view text, std::string_view place);

/// Returns all strokes of a strokes file, a JSON list of them; `file` is its name, fit to be shown. Error: Corrupt,
/// with the number of the stroke and the field.
[[nodiscard]] Result<std::vector<Stroke>> strokes_of(std::string_view text, std::string_view file);

}  // namespace relief
