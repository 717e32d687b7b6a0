// What the tests of documents share: models, strokes, a folder, and what a document tells.
#pragma once

#include "support/folder.h"
#include "support/shells.h"

#include <relief/session/document.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace relief::testing {

/// A sphere of radius 1 in model units: 128 slabs of n = 16.
inline Model ball() { return {.info = {}, .head = Snapshot::make(sphere_shell(2, 16))}; }

/// A stroke over the ball at the height z = sin(k / 3), with a tool that changes with k.
inline Stroke stroke_over_ball(int k, int points = 12) {
  constexpr std::array kTools = {Tool::Carve, Tool::Deposit, Tool::Paint, Tool::Smooth, Tool::Inflate};
  Stroke stroke;
  stroke.brush = {.tool = kTools[static_cast<std::size_t>(k) % kTools.size()], .radius = 0.15, .strength = 0.3};
  stroke.brush.colour = {0.8F, 0.1F, 0.2F};
  stroke.label = "stroke " + std::to_string(k + 1);
  const double z = 0.8 * std::sin(k / 3.0), r = std::sqrt(1 - z * z);
  for (int i = 0; i < points; ++i) {
    const double turn = 0.7 * k + 0.06 * i;
    stroke.points.push_back({0.02 * i, {r * std::cos(turn), r * std::sin(turn), z}, 0.5 + 0.03 * (i % 10)});
  }
  return stroke;
}

inline void post(Document& document, const Stroke& stroke, StrokeSource source = 0) {
  document.post(BeginStroke{.brush = stroke.brush, .tip = stroke.tip, .label = stroke.label, .source = source});
  document.post(MoveStroke{stroke.points, source});
  document.post(EndStroke{source});
}

/// All events so far.
class Events {
 public:
  void add(const Event& event) {
    const std::scoped_lock lock(mutex_);
    events_.push_back(event);
  }
  template <typename T>
  [[nodiscard]] std::vector<T> of() const {
    const std::scoped_lock lock(mutex_);
    std::vector<T> found;
    for (const Event& event : events_)
      if (const auto* one = std::get_if<T>(&event)) found.push_back(*one);
    return found;
  }
  [[nodiscard]] DocumentSettings settings(std::size_t history_bytes = std::size_t{512} << 20U) {
    return {.history_bytes = history_bytes, .on_event = [this](const Event& event) { add(event); }};
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Event> events_;
};

/// A new file with a model in it, as a document.
inline Document document_in(const std::filesystem::path& file, const Model& model, DocumentSettings settings = {}) {
  auto made = ModelFile::create(file, model);
  EXPECT_TRUE(made) << made.error().message;
  auto document = Document::open(file, *std::move(made), std::move(settings));
  EXPECT_TRUE(document) << document.error().message;
  return *std::move(document);
}

}  // namespace relief::testing
