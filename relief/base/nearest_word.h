// The known word that is most like a mistyped one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relief::detail {

/// Returns how many letters must be put in, left out, exchanged for another, or swapped with the next one to make `b`
/// of `a` (Damerau and Levenshtein, each letter moved once at most).
[[nodiscard]] inline std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      next[j] = std::min({row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        next[j] = std::min(next[j], before[j - 2] + 1);
    }
    before.swap(row);
    row.swap(next);
  }
  return row.back();
}

/// Returns the word with the fewest edits, if they are at most a third of its letters, and one for a word of three;
/// else empty.
[[nodiscard]] inline std::string_view nearest_word(std::string_view text, std::span<const std::string_view> words) {
  constexpr std::size_t kLongest = 64;  // nobody mistypes a longer one, and the cost grows with its square
  if (text.size() > kLongest) return {};
  std::string_view nearest;
  std::size_t fewest = kLongest;
  for (const std::string_view word : words) {
    const std::size_t edits = edits_between(text, word);
    if (edits >= fewest || edits > std::max<std::size_t>(word.size() / 3, 1)) continue;
    fewest = edits;
    nearest = word;
  }
  return nearest;
}
/// "; the nearest is X", or nothing.
[[nodiscard]] inline std::string nearest_clause(std::string_view text, std::span<const std::string_view> words) {
  const std::string_view meant = nearest_word(text, words);
  return meant.empty() ? std::string() : "; the nearest is " + std::string(meant);
}

}  // namespace relief::detail
