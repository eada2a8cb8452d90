#include "tools/import_readers.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include <opencv2/imgcodecs.hpp>

#include "test/support.hpp"

namespace cyclops::tools {
namespace {

namespace fs = std::filesystem;

constexpr Intrinsics kCamera{.width = 64, .height = 48, .fx_px = 80, .fy_px = 80, .cx_px = 31, .cy_px = 24};

class ImportReaders : public ::testing::Test {
 protected:
  std::string spill(const std::string& name, const std::string& text) {
    fs::create_directories(fs::path(dir_.file(name)).parent_path());
    std::ofstream(dir_.file(name)) << text;
    return dir_.file(name);
  }
  test::TempDir dir_;
};

/// A model 10 m away that drifts by `drift_px` a frame, with white noise of `white_px` an axis on the image.
std::vector<PriorPose> prior_of(int frames, double drift_px, double white_px) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, white_px);
  constexpr double kDepth_m = 10;
  std::vector<PriorPose> out(static_cast<std::size_t>(frames));
  for (int k = 0; k < frames; ++k) {
    const double u = drift_px * k + noise(random), v = noise(random);
    out[static_cast<std::size_t>(k)].T_c_m = {Rotation<frame::C, frame::M>(), Point<frame::C>(u * kDepth_m / kCamera.fx_px, v * kDepth_m / kCamera.fx_px, kDepth_m)};
  }
  return out;
}

double sigma_of(const std::vector<PriorPose>& prior) { return estimate_sigma_px(prior, Camera(kCamera, {}), Point<frame::M>(Vec3::Zero())); }

TEST_F(ImportReaders, TheEstimateTakesTheWhiteNoiseForAFifthOfTheVariance) {
  EXPECT_NEAR(sigma_of(prior_of(4000, 0, 2)), 2 * std::sqrt(5.0), 0.25);
}

TEST_F(ImportReaders, SteadyMotionIsNoNoise) {
  EXPECT_NEAR(sigma_of(prior_of(4000, 0.7, 2)), sigma_of(prior_of(4000, 0, 2)), 1e-9);
}

TEST_F(ImportReaders, TheEstimateStaysWithinItsLimits) {
  EXPECT_EQ(sigma_of(prior_of(100, 1, 0)), 1.5);
  EXPECT_EQ(sigma_of(prior_of(100, 0, 50)), 15);
  EXPECT_EQ(sigma_of(prior_of(9, 0, 50)), 6) << "seven differences are too few";
}

TEST_F(ImportReaders, APriorWithoutTimesRunsAtTheRateGiven) {
  auto prior = read_prior(spill("prior.csv", "frame,x_m,y_m,z_m,qw,qx,qy,qz\n4,1,2,9,1,0,0,0\n6,1,2,8,1,0,0,0\n"), 20);
  ASSERT_TRUE(prior.ok()) << prior.error().message();
  ASSERT_EQ(prior->size(), 2U);
  EXPECT_EQ(prior->front().t_ns, 200'000'000);
  EXPECT_EQ(prior->back().t_ns, 300'000'000);
  EXPECT_TRUE(prior->back().nav_update) << "no column: every pose is an update";
  EXPECT_EQ(prior->back().T_c_m.translation().xyz, Vec3(1, 2, 8));
}

TEST_F(ImportReaders, NamesTheLineWhereFramesDoNotRise) {
  const std::string path = spill("prior.csv", "frame,timestamp_s,x,y,z,qw,qx,qy,qz\n4,0,0,0,9,1,0,0,0\n4,1,0,0,9,1,0,0,0\n");
  EXPECT_EQ(read_prior(path, 30).error().message(), path + ":3: frame 4 after frame 4");
}

TEST_F(ImportReaders, APictureWithoutNumberHasItsPlaceInOrder) {
  for (const char* name : {"in/frames/a.png", "in/frames/b.PGM", "in/frames/c_0040.png", "in/frames/notes.txt"}) spill(name, "");
  auto pictures = list_pictures(dir_.file("in"));
  ASSERT_TRUE(pictures.ok()) << pictures.error().message();
  EXPECT_EQ(*pictures, (PictureByFrame{{0, dir_.file("in/frames/a.png")}, {1, dir_.file("in/frames/b.PGM")}, {40, dir_.file("in/frames/c_0040.png")}}));
  EXPECT_EQ(list_pictures(dir_.file("none")).error().message(), dir_.file("none") + "/frames: holds no .png or .pgm file");
}

TEST_F(ImportReaders, ColourBecomesGreyOfTheSameBits) {
  ASSERT_TRUE(cv::imwrite(dir_.file("c.png"), cv::Mat(48, 64, CV_16UC3, cv::Scalar(900, 900, 900))));
  auto picture = read_picture(dir_.file("c.png"), kCamera);
  ASSERT_TRUE(picture.ok()) << picture.error().message();
  EXPECT_TRUE(picture->from_colour);
  EXPECT_EQ(picture->samples.type(), CV_16UC1);
  EXPECT_EQ(picture->samples.at<std::uint16_t>(47, 63), 900);
}

}  // namespace
}  // namespace cyclops::tools
