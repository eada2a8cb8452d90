#include "detect/corner_kernel.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>

#include "detect/corner_reference.hpp"
#include "test/detect/images.hpp"

namespace cyclops {
namespace {

KernelJob whole_box(const ImageView& image) {
  const PixelRect all{0, 0, image.width, image.height};
  return {image, all, true, all, all, all};
}

struct Ran {
  KernelResult result;
  std::vector<float> picture;
  std::vector<Peak> peaks;
};
Ran run(const KernelJob& job, const KernelConfig& config) {
  Ran out;
  out.picture.resize(static_cast<std::size_t>((job.measure.u1 - job.measure.u0) * (job.measure.v1 - job.measure.v0)));
  out.peaks.resize(out.picture.size() + 1);
  out.result = std::make_unique<CornerKernel>(config)->run(job, out.peaks, out.picture.data());
  out.peaks.resize(out.result.peaks);
  return out;
}

double mean_of(const std::vector<double>& rc, int width, int border) {
  const int height = static_cast<int>(rc.size()) / width;
  double sum = 0;
  for (int v = border; v < height - border; ++v)
    for (int u = border; u < width - border; ++u) sum += rc[static_cast<std::size_t>(v * width + u)];
  return sum / ((width - 2 * border) * (height - 2 * border));
}

bool same_peaks(std::vector<Peak> a, std::vector<Peak> b) {
  const auto raster = [](const Peak& x, const Peak& y) { return x.v != y.v ? x.v < y.v : x.u < y.u; };
  std::sort(a.begin(), a.end(), raster);
  std::sort(b.begin(), b.end(), raster);
  const auto equal = [](const Peak& x, const Peak& y) { return x.u == y.u && x.v == y.v && x.measure == y.measure; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), equal);
}

TEST(CornerKernel, HasTheSpecsWeights) {
  const KernelConfig c = kernel_config(1, 7, 3, 1e-6);
  EXPECT_NEAR(c.weight[0], 0.399050, 5e-7);
  EXPECT_NEAR(c.weight[1], 0.242036, 5e-7);
  EXPECT_NEAR(c.weight[2], 0.054006, 5e-7);
  EXPECT_NEAR(c.weight[3], 0.004433, 5e-7);
}

TEST(CornerKernel, GivesTheSpecsValuesOnTheStepCorner) {
  const auto image = test::step_corner_21();
  const auto rc = reference_measure<double>(whole_box(image.view()), 7, 1.0, 1e-6);
  const auto at = [&](int row, int column) { return rc[static_cast<std::size_t>(row * 21 + column)]; };
  EXPECT_NEAR(at(10, 10), 1959.558055, 1e-6);
  EXPECT_NEAR(at(9, 9), 874.074658, 1e-6);
  EXPECT_NEAR(at(9, 10), 1201.985745, 1e-6);
  EXPECT_NEAR(at(11, 11), 1332.148913, 1e-6);
  EXPECT_NEAR(at(8, 8), 84.042883, 1e-6);
  EXPECT_NEAR(at(10, 16), 0, 1e-6);
  EXPECT_NEAR(mean_of(rc, 21, 5), 125.338091, 1e-6);
  EXPECT_NEAR(mean_of(rc, 21, 5) * 11 * 11 / (21 * 21), 34.389816, 1e-6);  // border cleared, then over everything
  EXPECT_NEAR(mean_of(rc, 21, 0), 88.704774, 1e-6);                        // border with the padding's blow-up
  // A = B = 4484.561299 and C = 1592.411257 follow from Rc = (A^2 - C^2) / (2 A)
  EXPECT_NEAR((4484.561299 * 4484.561299 - 1592.411257 * 1592.411257) / (2 * 4484.561299), at(10, 10), 1e-5);
}

TEST(CornerKernel, FastKernelGivesTheSameValuesToFloatPrecision) {
  const auto image = test::step_corner_21();
  const auto ran = run(whole_box(image.view()), kernel_config(1, 7, 3, 1e-6));
  EXPECT_NEAR(ran.picture[10 * 21 + 10], 1959.558055, 5e-4);
  EXPECT_NEAR(ran.result.mean(), 88.704774, 5e-5);
  KernelJob cropped = whole_box(image.view());
  cropped.mean = cropped.search = cropped.measure.grown(-5);
  const auto inner = run(cropped, kernel_config(1, 7, 3, 1e-6));
  EXPECT_NEAR(inner.result.mean(), 125.338091, 5e-5);
  ASSERT_EQ(inner.peaks.size(), 1U);
  EXPECT_EQ(inner.peaks[0].u, 10);
  EXPECT_EQ(inner.peaks[0].v, 10);
}

TEST(CornerKernel, ZeroPaddingMakesAnEdgeOf60OutOfAConstantImage) {
  // GIVEN a constant image of 60
  test::Image image(21, 21, PixelFormat::kMono8);
  image.fill([](int, int) { return 60; });
  // WHEN the box is padded with zeros THEN its border answers, most in the corners; with real pixels nothing does
  KernelJob job = whole_box(image.view());
  const auto padded = run(job, kernel_config(1, 7, 3, 1e-6));
  job.zero_outside = false;
  const auto real = run(job, kernel_config(1, 7, 3, 1e-6));
  EXPECT_GT(padded.picture[0], 100);
  EXPECT_EQ(padded.picture[10 * 21 + 10], 0);
  EXPECT_EQ(std::accumulate(real.picture.begin(), real.picture.end(), 0.0F), 0);
  ASSERT_EQ(real.peaks.size(), 1U);  // first pixel of the one plateau, of measure 0: no mean lies below it
  EXPECT_EQ(real.peaks[0].measure, 0);
}

TEST(CornerKernel, EqualsTheScalarReferenceBitForBit) {
  test::Random random(11);
  const auto in = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  for (int trial = 0; trial < 120; ++trial) {
    const auto format = static_cast<PixelFormat>(in(0, 3));
    const auto image = test::random_image(in(1, trial % 10 == 0 ? 450 : 90), in(1, 60), format, random);
    const PixelRect all{0, 0, image.width, image.height};
    // GIVEN a box somewhere, also at the border and of any width
    const int u0 = in(0, image.width - 1), v0 = in(0, image.height - 1);
    const PixelRect box{u0, v0, in(u0 + 1, image.width), in(v0 + 1, image.height)};
    RowMask missing;
    if (trial % 3 == 0) missing.set_missing(in(0, image.height - 1));
    KernelJob job{image.view(), all, trial % 2 == 0, box, box, box, trial % 3 == 0 ? &missing : nullptr};
    if (trial % 4 < 2) job.domain = box;
    job.search = box.grown(-in(0, 4)).within(box);
    const int size = 3 + 2 * in(0, 5), radius = in(1, 7);
    const double sigma = 0.5 + 0.3 * in(0, 5);
    // WHEN both compute it THEN measure and maxima agree in every bit
    const auto fast = run(job, kernel_config(sigma, size, radius, 1e-6));
    const auto slow = reference_measure<float>(job, size, sigma, 1e-6);
    ASSERT_EQ(fast.picture, slow) << trial;
    if (job.missing != nullptr) continue;
    EXPECT_TRUE(same_peaks(fast.peaks, reference_maxima(job, slow, radius))) << trial;
    EXPECT_NEAR(fast.result.sum, std::accumulate(slow.begin(), slow.end(), 0.0), 1e-5 * std::abs(fast.result.sum));
    EXPECT_EQ(fast.result.pixels, static_cast<std::int64_t>(slow.size()));
  }
}

TEST(CornerKernel, OfAPlateauTheFirstPixelInRasterOrderStays) {
  // GIVEN a period of 4 px in both directions, so that equal maxima lie within each other's square
  test::Image image(64, 64, PixelFormat::kMono8);
  image.fill([](int u, int v) { return u % 4 < 2 && v % 4 < 2 ? 200 : 20; });
  KernelJob job = whole_box(image.view());
  job.search = job.measure.grown(-12);
  const auto ran = run(job, kernel_config(1, 7, 3, 1e-6));
  EXPECT_TRUE(same_peaks(ran.peaks, reference_maxima(job, ran.picture, 3)));
  for (std::size_t i = 0; i < ran.peaks.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_FALSE(std::abs(ran.peaks[i].u - ran.peaks[j].u) <= 3 && std::abs(ran.peaks[i].v - ran.peaks[j].v) <= 3);
}

TEST(CornerKernel, SixteenBitsOf256TimesTheCountsGive65536TimesTheMeasure) {
  test::Random random(5);
  const auto narrow = test::random_image(150, 40, PixelFormat::kMono8, random);
  test::Image wide(150, 40, PixelFormat::kMono16);
  wide.fill([&](int u, int v) { return 256 * narrow.get(u, v); });
  const auto a = run(whole_box(narrow.view()), kernel_config(1, 7, 3, 1e-6)), b = run(whole_box(wide.view()), kernel_config(1, 7, 3, 1e-6));
  ASSERT_EQ(a.peaks.size(), b.peaks.size());
  for (std::size_t i = 0; i < a.peaks.size(); ++i) {
    EXPECT_EQ(a.peaks[i].u, b.peaks[i].u);
    EXPECT_EQ(a.peaks[i].v, b.peaks[i].v);
    EXPECT_NEAR(b.peaks[i].measure, 65536.0F * a.peaks[i].measure, 1e-6F * b.peaks[i].measure);
  }
}

TEST(CornerKernel, AFullStoreOfPeaksIsCounted) {
  test::Random random(6);
  const auto image = test::random_image(100, 100, PixelFormat::kMono8, random);
  std::vector<Peak> few(10);
  const auto result = std::make_unique<CornerKernel>(kernel_config(1, 7, 3, 1e-6))->run(whole_box(image.view()), few);
  EXPECT_EQ(result.peaks, 10U);
  EXPECT_GT(result.lost, 100U);
}

}  // namespace
}  // namespace cyclops
