// Which tool is in the hand: made from the library's table, whatever is in it.
#include <gtest/gtest.h>
#include <studio/tool_state.h>

#include <QSignalSpy>

namespace relief::studio {
namespace {

TEST(ToolState, HasTouchAndAllToolsOfTheLibraryEachWithAKeyOfItsOwn) {
  EXPECT_EQ(ToolState::ids().size(), qsizetype(tools().size()) + 1);
  QStringList keys;
  for (const QString& id : ToolState::ids()) {
    EXPECT_FALSE(ToolState::title(id).isEmpty()) << id.toStdString();
    EXPECT_FALSE(ToolState::help(id).isEmpty()) << id.toStdString();
    keys.append(ToolState::key(id));
  }
  EXPECT_FALSE(keys.contains(QString()));
  keys.removeDuplicates();
  EXPECT_EQ(keys.size(), ToolState::ids().size()) << keys.join(' ').toStdString();
}

TEST(ToolState, RadiusBelongsToTheHandAndStrengthToTheTool) {
  ToolState state;
  state.set_diagonal(200);
  state.choose("smooth");
  state.set_value("radius", 12);
  state.set_value("strength", 0.9);
  state.choose("carve");
  EXPECT_EQ(state.brush().radius, 12);
  EXPECT_NE(state.brush().strength, 0.9);
  EXPECT_EQ(state.smoothing().strength, 0.9);
}

TEST(ToolState, ValuesStayInTheirRangesAndAreToldOnce) {
  ToolState state;
  state.set_diagonal(100);
  QSignalSpy told(&state, &ToolState::settingChanged);
  state.set_value("radius", 1e9);
  EXPECT_EQ(state.value("radius"), state.most_radius());
  state.set_value("radius", 1e9);
  EXPECT_EQ(told.count(), 1);
  state.set_value("radius", -1);
  EXPECT_EQ(state.value("radius"), state.least_radius());
  state.set_value("strength", 7);
  EXPECT_EQ(state.value("strength"), 1);
}

TEST(ToolState, TheSampleSpacingIsTheHandsAndGoesIntoEveryStroke) {
  ToolState state;
  for (const QString& id : ToolState::ids()) EXPECT_EQ(state.brush_of(id).detail, kDetail) << id.toStdString();
  state.choose("carve");
  state.set_value("detail", 0.02);
  state.choose("smooth");
  EXPECT_EQ(state.brush().detail, 0.02);
  EXPECT_EQ(state.inverted().value_or(state.brush()).detail, 0.02);
  state.set_value("detail", 3);
  EXPECT_EQ(state.brush().detail, kCoarsestDetail);
  state.set_value("detail", -1);
  EXPECT_EQ(state.brush().detail, 0) << "the grid stays as it is";
  state.forget_hand();
  EXPECT_EQ(state.brush().detail, kDetail);
}

TEST(ToolState, OppositesAreMutualAndKeepTheStrength) {
  ToolState state;
  state.set_value("strength", 0.37);
  const auto inverted = state.inverted();
  ASSERT_TRUE(inverted);
  EXPECT_EQ(inverted->tool, Tool::Deposit);
  EXPECT_EQ(inverted->strength, 0.37);
  for (const ToolInfo& tool : tools()) {
    if (tool.opposite.empty()) continue;
    const auto other = tool_from_name(tool.opposite);
    ASSERT_TRUE(other) << tool.id;
    EXPECT_EQ(info(*other).opposite, tool.id);
  }
  state.choose("layer");
  state.set_value("height", 0.01);
  ASSERT_TRUE(state.inverted());
  EXPECT_EQ(state.inverted()->height, -0.01);
  state.choose("smooth");
  EXPECT_FALSE(state.inverted());
}

TEST(ToolState, LengthsFollowTheModel) {
  ToolState state;
  state.set_diagonal(1000);
  EXPECT_EQ(state.value("radius"), 40);
  state.set_diagonal(10);
  EXPECT_EQ(state.value("radius"), 0.4);
}

}  // namespace
}  // namespace relief::studio
