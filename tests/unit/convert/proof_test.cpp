// What a conversion may be called, once the verifier has judged it.
#include <relief/convert/proof.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <utility>

namespace relief {
namespace {

/// A certified model of the sample.
Conversion certified() {
  auto mesh = make_sample("bowl", 20'000, {});
  EXPECT_TRUE(mesh);
  auto made = convert(std::move(*mesh), {}, {});
  EXPECT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->model.info.mode, Mode::Certified);
  return std::move(*made);
}
/// A triangle of the source shows its back to the fibres.
void turn_one(TriangleMesh& mended) { std::swap(mended.triangles[100][0], mended.triangles[100][1]); }

TEST(Proof, WhatHoldsIsCalledCertified) {
  Conversion made = certified();
  const auto proof = prove(made, {}, false);
  ASSERT_TRUE(proof) << proof.error().message;
  EXPECT_TRUE(proof->with_source);
  EXPECT_TRUE(proof->all());
  EXPECT_EQ(made.model.info.mode, Mode::Certified);
  EXPECT_FALSE(made.report.refused);
}

TEST(Proof, WhatTheBuilderOnlyTakesForCertifiedIsTolerantAndSaysWhy) {
  Conversion made = certified();
  turn_one(made.mended);
  const auto proof = prove(made, {}, false);
  ASSERT_TRUE(proof) << proof.error().message;
  EXPECT_EQ(made.model.info.mode, Mode::Tolerant);
  EXPECT_TRUE(made.report.refused);
  EXPECT_TRUE(made.report.not_certified.starts_with("the verifier refused the shell: ")) << made.report.not_certified;
}

TEST(Proof, AModeThatWasAskedForIsRefusedWithARemedy) {
  Conversion made = certified();
  turn_one(made.mended);
  const auto proof = prove(made, Mode::Certified, false);
  ASSERT_FALSE(proof);
  EXPECT_EQ(proof.error().code, Errc::Unfoldable);
  EXPECT_NE(proof.error().message.find("use --remesh or --mode tolerant"), std::string::npos) << proof.error().message;
}

TEST(Proof, WhatWasGivenUpForNothingIsCertifiedNevertheless) {
  Conversion made = certified();
  made.model.info.mode = Mode::Tolerant;
  made.report.not_certified = "a guess";
  ASSERT_TRUE(prove(made, {}, false));
  EXPECT_EQ(made.model.info.mode, Mode::Certified);
  EXPECT_TRUE(made.report.not_certified.empty());
  // Not where something of the source is missing.
  Conversion part = certified();
  part.model.info.mode = Mode::Tolerant;
  part.report.coverage.share = 0.9;
  ASSERT_TRUE(prove(part, {}, false));
  EXPECT_EQ(part.model.info.mode, Mode::Tolerant);
}

TEST(Proof, CanBeCancelled) {
  Conversion made = certified();
  const std::atomic<bool> cancel{true};
  const auto proof = prove(made, {}, false, Progress{{}, &cancel});
  ASSERT_FALSE(proof);
  EXPECT_EQ(proof.error().code, Errc::Cancelled);
}

}  // namespace
}  // namespace relief
