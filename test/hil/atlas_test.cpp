// Pictures of a tanker's shape: are they there, and do they mark what is seen and what is not?
#include "hil/atlas.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "hil/mesh_builder.hpp"
#include "test/support.hpp"

namespace cyclops::hil {
namespace {

constexpr double kInch_m = 0.0254;
constexpr int kTile_px = 220;

TEST(Atlas, MarksAFeatureThatIsSeenGreenAndAHiddenOneRed) {
  // GIVEN a box with a feature at an after corner and one at a forward corner, and a camera behind it
  const test::TempDir dir;
  MeshBuilder b;
  b.box({0, -50, -50}, {200, 50, 50}, b.material({"x", 0.5F, 0, true}));
  const auto model = TankerModel::parse("id,x,y,z,normals\n1,200,50,-50,1 0 0\n2,0,50,50,-1 0 0\n", "box.csv", kInch_m, {0, 0, 0}).value();
  // WHEN the atlas is drawn
  const auto done = draw_atlas(dir.file("atlas"), b.mesh(), model, {.reference_m = {200 * kInch_m, 0, 0}, .range_m = 20});
  ASSERT_TRUE(done.ok()) << done.error().message();
  // THEN the close-up of each has a cross of its colour
  for (const char* name : {"three_view.png", "receiver.png", "contact.png"}) EXPECT_FALSE(cv::imread(dir.file("atlas") + "/" + name).empty()) << name;
  const cv::Mat close = cv::imread(dir.file("atlas") + "/features.png");
  ASSERT_EQ(close.size(), cv::Size(8 * kTile_px, kTile_px));
  const auto greener = [&](int tile) {  // the cross's right arm, a pixel thick, lies beside the tile's middle
    int most = 0;
    for (int v = kTile_px / 2 - 1; v <= kTile_px / 2 + 1; ++v) {
      const cv::Vec3b p = close.at<cv::Vec3b>(v, tile * kTile_px + kTile_px / 2 + 16);
      if (const int g = int{p[1]} - int{p[2]}; std::abs(g) > std::abs(most)) most = g;
    }
    return most;
  };
  EXPECT_GT(greener(0), 100);
  EXPECT_LT(greener(1), -100);
}

TEST(Atlas, NamesAFolderThatCannotBeMade) {
  MeshBuilder b;
  b.box({0, 0, 0}, {1, 1, 1}, b.material({"x", 0.5F, 0, true}));
  const auto model = TankerModel::parse("id,x,y,z\n1,1,1,1\n", "box.csv", kInch_m, {0, 0, 0}).value();
  const auto done = draw_atlas("/proc/atlas", b.mesh(), model, {});
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().message().find("/proc/atlas: cannot be made"), std::string::npos) << done.error().message();
}

}  // namespace
}  // namespace cyclops::hil
