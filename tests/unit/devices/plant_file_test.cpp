// A simulated device whose figures are in a file: what is taken over, and what is refused with which words.
#include <relief/devices/open_device.h>
#include <relief/devices/plant_file.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace relief {
namespace {

class PlantFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    file_ = std::filesystem::temp_directory_path() / (std::string("relief-") + test->name() + ".json");
  }
  void TearDown() override { std::filesystem::remove(file_); }

  Result<detail::PlantFile> read(std::string_view text) {
    std::ofstream(file_, std::ios::binary) << text;
    return detail::read_plant_file(file_);
  }

  std::filesystem::path file_;
};

TEST_F(PlantFiles, WhatIsNotNamedIsAsInThePreset) {
  const auto empty = read("{}");
  ASSERT_TRUE(empty) << empty.error().message;
  EXPECT_EQ(empty->preset.plant.mass, 0.045);
  EXPECT_EQ(empty->hand.stiffness, 300);
  const auto all = read(R"({"like": "falcon-like", "plant": {"mass": 0.2, "delay_ticks": 2, "jitter": [0, 3, 1]},
                            "device": {"max_force": 5.5, "delay_ticks": 2}, "hand": {"pump": 1, "tremor": 1e-3}})");
  ASSERT_TRUE(all) << all.error().message;
  EXPECT_EQ(all->preset.plant.mass, 0.2);
  EXPECT_EQ(all->preset.plant.viscous, 0.5);
  EXPECT_EQ(all->preset.plant.delay_ticks, 2);
  EXPECT_EQ(all->preset.plant.jitter, (std::vector<std::uint8_t>{0, 3, 1}));
  EXPECT_EQ(all->preset.info.max_force, 5.5);
  EXPECT_EQ(all->preset.info.max_stiffness, 3000);
  EXPECT_EQ(all->hand.pump, 1);
  EXPECT_EQ(all->hand.damping, 3);
}

TEST_F(PlantFiles, EachFigureGoesWhereItBelongs) {
  const auto all = read(R"({
    "plant": {"mass": 0.11, "viscous": 0.12, "coulomb": 0.13, "encoder_step": 0.001, "max_force": 14, "slew": 15, "dac_step": 0.16,
              "lag": 0.17, "resonance": 18, "resonance_damping": 0.19, "delay_ticks": 1, "jitter": [2], "watchdog": 0.2,
              "substeps": 21, "silent_at": 0.22, "silent_for": 0.23},
    "device": {"max_force": 31, "max_stiffness": 32, "max_damping": 33, "max_force_rate": 34, "max_torque": 35,
               "continuous_force": 36, "max_work": 37, "max_speed": 8, "delay_ticks": 3, "delay": 0.05, "rate": 10,
               "workspace_radius": 9},
    "hand": {"stiffness": 41, "damping": 42, "max_force": 43, "tremor": 0.044, "pump": 45}})");
  ASSERT_TRUE(all) << all.error().message;
  const Plant& plant = all->preset.plant;
  EXPECT_EQ((std::vector{plant.mass, plant.viscous, plant.coulomb, plant.encoder_step, plant.max_force, plant.slew,
                         plant.dac_step, plant.lag, plant.resonance, plant.resonance_damping, plant.watchdog,
                         plant.silent_at, plant.silent_for}),
            (std::vector{0.11, 0.12, 0.13, 0.001, 14.0, 15.0, 0.16, 0.17, 18.0, 0.19, 0.2, 0.22, 0.23}));
  EXPECT_EQ((std::vector{plant.delay_ticks, plant.substeps, static_cast<int>(plant.jitter.at(0))}),
            (std::vector{1, 21, 2}));
  const DeviceInfo& info = all->preset.info;
  EXPECT_EQ(
      (std::vector{info.max_force, info.max_stiffness, info.max_damping, info.max_force_rate, info.max_torque,
                   info.continuous_force, info.max_work, info.max_speed, info.delay, info.rate, info.workspace_radius}),
      (std::vector<double>{31, 32, 33, 34, 35, 36, 37, 8, 0.05, 10, 9}));
  EXPECT_EQ(info.delay_ticks, 3);
  const Hand& hand = all->hand;
  EXPECT_EQ((std::vector{hand.stiffness, hand.damping, hand.max_force, hand.tremor, hand.pump}),
            (std::vector<double>{41, 42, 43, 0.044, 45}));
  std::string jitter = "0";
  for (int k = 0; k < 999; ++k) jitter += ",0";
  EXPECT_TRUE(read("{\"plant\": {\"jitter\": [" + jitter + "]}}"));
  jitter += ",0";
  EXPECT_FALSE(read("{\"plant\": {\"jitter\": [" + jitter + "]}}")) << "1001 entries";
}

TEST_F(PlantFiles, WhatIsWrongIsNamedInOneSentence) {
  struct Case {
    std::string_view text, says;
  };
  for (const auto& [text, says] :
       {Case{"", "must be a JSON object"}, Case{"[1]", "must be a JSON object"}, Case{"{\"plant\": ", "must be a JSON"},
        Case{R"({"plant": {"mass": NaN}})", "must be a JSON"}, Case{R"({"plant": {"mass": 1e999}})", "must be a JSON"},
        Case{R"({"arm": {}})", "but not \"arm\""}, Case{R"({"like": "omega"})", "one of touch-like, premium-like"},
        Case{R"({"like": 3})", "and is 3"}, Case{R"({"plant": 3})", "\"plant\" must be an object"},
        Case{R"({"plant": {"masss": 1}})", "no figure \"masss\", but mass, viscous"},
        Case{R"({"plant": {"mass": -1}})", "plant.mass must be a number from 0.001 to 10, and is -1"},
        Case{R"({"plant": {"mass": "1"}})", "plant.mass must be a number from 0.001 to 10, and is \"1\""},
        Case{R"({"plant": {"delay_ticks": 1.5}})", "plant.delay_ticks must be a whole number from 0 to 3"},
        Case{R"({"plant": {"delay_ticks": 4}})", "and is 4"},
        Case{R"({"plant": {"jitter": [0, 9]}})", "plant.jitter must be a list of whole numbers from 0 to 3, and is 9"},
        Case{R"({"device": {"max_force": 1e6}})", "device.max_force must be a number from 0 to 1000"},
        Case{R"({"device": {"name": "x"}})", "\"device\" has no figure \"name\""},
        Case{R"({"hand": {"stiffness": null}})", "hand.stiffness must be a number from 0 to 10000, and is null"}}) {
    const auto refused = read(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_EQ(refused.error().code, Errc::Corrupt) << text;
    EXPECT_NE(refused.error().message.find(says), std::string::npos) << text << ": " << refused.error().message;
    EXPECT_NE(refused.error().message.find(file_.filename().string()), std::string::npos);
    EXPECT_EQ(refused.error().message.find('\n'), std::string::npos);
  }
  // However deep the nesting.
  const auto deep = read("{\"plant\": {\"jitter\": " + std::string(100'000, '[') + std::string(100'000, ']') + "}}");
  ASSERT_FALSE(deep);
  EXPECT_NE(deep.error().message.find("and is a list"), std::string::npos) << deep.error().message;
  EXPECT_EQ(detail::read_plant_file(file_.string() + ".gone.json").error().code, Errc::NotFound);
  EXPECT_EQ(detail::read_plant_file(file_.parent_path()).error().code, Errc::Io);
}

TEST_F(PlantFiles, AFileOfOverAMebibyteIsNone) {
  constexpr std::size_t kMebibyte = 1048576;
  EXPECT_TRUE(read("{" + std::string(kMebibyte - 2, ' ') + "}"));
  const auto refused = read("{" + std::string(kMebibyte - 1, ' ') + "}");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("larger than 1 MiB"), std::string::npos) << refused.error().message;
}

TEST_F(PlantFiles, ADeviceIsOpenedByTheNameOfTheFile) {
  ASSERT_TRUE(read(R"({"device": {"max_force": 2.5}})"));
  const std::string name = "sim:hand:" + file_.string();
  const auto device = open_device(name, [](double) { return HandTarget{}; });
  ASSERT_TRUE(device) << device.error().message;
  EXPECT_EQ((*device)->info().name, name);
  EXPECT_EQ((*device)->info().max_force, 2.5);
  EXPECT_EQ(open_device("sim:hand:gone.json", {}).error().code, Errc::NotFound);
  EXPECT_NE(open_device("sim:hand:gone.json", {}).error().message.find("gone.json: no such file"), std::string::npos);
}

TEST(PlantFile, TheExampleIsGood) {
  const auto arm = detail::read_plant_file(std::filesystem::path(RELIEF_SOURCE_DIR) / "examples" / "arm.json");
  ASSERT_TRUE(arm) << arm.error().message;
  EXPECT_EQ(arm->preset.plant.mass, 0.12);
}

}  // namespace
}  // namespace relief
