// A window with a model that a test made.
#pragma once

#include "support/folder.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/main_window.h>
#include <studio/text.h>

#include <QTest>
#include <memory>
#include <utility>

namespace relief::studio {

/// Shows the window and opens a new file in the folder; returns when the model is seen.
inline void open_in(MainWindow& window, const testing::Folder& folder, std::shared_ptr<const SlabMesh> cage) {
  constexpr int kPatience = 60'000;  // ms, on a machine that is busy with other things
  Model model;
  model.head = Snapshot::make(std::move(cage));
  const auto file = folder / "model.relief";
  ASSERT_TRUE(ModelFile::create(file, model));
  window.show();
  window.open(text(file));
  ASSERT_TRUE(QTest::qWaitFor([&] { return window.viewport().scene().model != nullptr; }, kPatience));
}

}  // namespace relief::studio
