// Early return for Result, for source files only (no public header includes this).
#pragma once

#include <relief/base/error.h>

#define RELIEF_TRY_JOIN2(a, b) a##b
#define RELIEF_TRY_JOIN(a, b) RELIEF_TRY_JOIN2(a, b)

// A declaration cannot stand in parentheses.
// NOLINTBEGIN(bugprone-macro-parentheses)
/// RELIEF_TRY(auto mesh, import_mesh(path)); declares `mesh`, or returns the error from the enclosing function.
#define RELIEF_TRY(declaration, expression)                                            \
  auto RELIEF_TRY_JOIN(relief_try_, __LINE__) = (expression);                          \
  if (!RELIEF_TRY_JOIN(relief_try_, __LINE__))                                         \
    return std::unexpected(std::move(RELIEF_TRY_JOIN(relief_try_, __LINE__)).error()); \
  declaration = *std::move(RELIEF_TRY_JOIN(relief_try_, __LINE__))
// NOLINTEND(bugprone-macro-parentheses)

/// RELIEF_CHECK(save(model)); returns the error of a Status from the enclosing function.
#define RELIEF_CHECK(expression) \
  if (auto relief_status = (expression); !relief_status) return std::unexpected(std::move(relief_status).error())
