// What the hand holds is what it held the last time.
#include "support/folder.h"

#include <gtest/gtest.h>
#include <studio/text.h>
#include <studio/tool_state.h>

#include <QSettings>
#include <cmath>

namespace relief::studio {
namespace {

class ToolsTest : public ::testing::Test {
 protected:
  /// Every number of every tool that a person can set.
  template <typename Call>
  static void each(ToolState& state, Call&& call) {
    for (const ToolInfo& tool : tools()) {
      state.choose(text(tool.id));
      for (const SettingInfo& setting : tool.settings)
        if (setting.kind == SettingInfo::Kind::Value || setting.kind == SettingInfo::Kind::Switch ||
            setting.kind == SettingInfo::Kind::Choice)
          call(text(tool.id) + "/" + text(setting.id), setting);
    }
  }
  /// Something else than a fresh tool has.
  static double other(const ToolState& state, const SettingInfo& setting) {
    if (setting.kind != SettingInfo::Kind::Value) return 1;
    const auto [low, high] = state.range(setting);
    return low + 0.3 * (high - low);
  }

  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
};

TEST_F(ToolsTest, AllThatIsSetIsThereAgainOnAModelOfAnotherSize) {
  ToolState before;
  before.set_diagonal(200);
  each(before,
       [&](const QString&, const SettingInfo& setting) { before.set_value(text(setting.id), other(before, setting)); });
  before.choose("inflate");
  before.keep(settings);

  ToolState after;
  after.take_kept(settings);
  after.set_diagonal(50);
  EXPECT_EQ(after.id(), "inflate");
  int lengths = 0, others = 0;
  each(after, [&](const QString& name, const SettingInfo& setting) {
    before.choose(after.id());
    const bool length = setting.unit == SettingInfo::Unit::Length;
    const bool kept = setting.id != "symmetry" && setting.id != "pressure_drives";
    const double was = before.value(text(setting.id)), is = after.value(text(setting.id));
    EXPECT_NEAR(is, !kept ? setting.preset : length ? was / 4 : was, 1e-9) << name.toStdString();
    (length ? lengths : others) += kept;
  });
  EXPECT_GT(lengths, 0);
  EXPECT_GT(others, 0);
}

TEST_F(ToolsTest, WhatCannotBeIsNotTakenOver) {
  settings.setValue("tools/in-hand", "hammer");
  settings.setValue("tools/radius", "wide");
  settings.setValue("tools/carve/strength", 7);
  settings.setValue("tools/carve/falloff", 99);
  ToolState state;
  const double radius = state.value("radius"), falloff = state.value("falloff");
  state.take_kept(settings);
  EXPECT_EQ(state.id(), "carve");
  EXPECT_EQ(state.value("radius"), radius);
  EXPECT_EQ(state.value("strength"), 1);
  EXPECT_EQ(state.value("falloff"), falloff);
}

TEST_F(ToolsTest, TheRadiusKeepsItsShareOfTheModel) {
  ToolState state;
  state.set_diagonal(100);
  EXPECT_DOUBLE_EQ(state.value("radius"), 4);
  state.set_value("radius", 2);
  state.set_diagonal(300);
  EXPECT_DOUBLE_EQ(state.value("radius"), 6);
  for (const double none : {0.0, -1.0, double(INFINITY), double(NAN)}) state.set_diagonal(none);
  EXPECT_DOUBLE_EQ(state.value("radius"), 6) << "a mesh with points at infinity has no size";
  state.forget_hand();
  EXPECT_DOUBLE_EQ(state.value("radius"), 12);
}

}  // namespace
}  // namespace relief::studio
