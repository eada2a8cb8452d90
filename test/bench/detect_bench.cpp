#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>

#include "detect/corner_detector.hpp"
#include "detect/pixel_noise.hpp"
#include "test/bench/bench.hpp"

namespace cyclops {
namespace {

constexpr int kSide = 1024;

/// A sky gradient, soft clouds, an aircraft of polygons, noise of 2 in 255; 8 bits, or 12 bits in 16.
cv::Mat scene(int type) {
  cv::RNG random(1);
  cv::Mat clouds(kSide / 64, kSide / 64, CV_32F), image;
  random.fill(clouds, cv::RNG::UNIFORM, 0, 30);
  cv::resize(clouds, image, {kSide, kSide}, 0, 0, cv::INTER_CUBIC);
  for (int v = 0; v < kSide; ++v) image.row(v) += 90 + 50.0 * v / kSide;
  for (int i = 0; i < 60; ++i) {
    std::vector<cv::Point> p;
    const cv::Point centre(random.uniform(200, 824), random.uniform(300, 724));
    for (int k = 0; k < 4; ++k) p.push_back(centre + cv::Point(random.uniform(-60, 60), random.uniform(-25, 25)));
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{p}, random.uniform(20.0, 230.0), cv::LINE_8);
  }
  cv::GaussianBlur(image, image, {}, 0.7);
  cv::Mat noise(kSide, kSide, CV_32F), out;
  random.fill(noise, cv::RNG::NORMAL, 0, 2);
  image += noise;
  image.convertTo(out, type, type == CV_8U ? 1 : 16);
  return out;
}

ImageView view(const cv::Mat& m) {
  return {m.data, m.cols, m.rows, static_cast<int>(m.step), m.depth() == CV_8U ? PixelFormat::kMono8 : PixelFormat::kMono12};
}

/// n boxes of 61 x 61 in a grid over the aircraft, or the whole frame for n = 0.
SubImageSet boxes_of(int n) {
  if (n == 0) return {{0, 0, kSide, kSide, 1}};
  SubImageSet boxes;
  for (int i = 0; i < n; ++i) boxes.push_back({170 + 100 * (i % 7), 300 + 100 * (i / 7), 61, 61, 1});
  return boxes;
}

double pixels_of(const SubImageSet& boxes) {
  double n = 0;
  for (const SubImage& b : boxes) n += b.width * b.height;
  return n;
}

/// The peer's job on each sub-image; 16 bits become float first, for it takes nothing else.
template <class F>
std::function<void()> on_each(const cv::Mat& image, const SubImageSet& boxes, F job) {
  return [=] {
    for (const SubImage& b : boxes) {
      cv::Mat part = image(cv::Rect(b.u0, b.v0, b.width, b.height)), converted;
      if (part.depth() == CV_16U) part.convertTo(converted, CV_32F);
      else converted = part;
      job(converted);
    }
  };
}

std::function<void()> kernel_alone(const cv::Mat& image, const SubImageSet& boxes, int gaussian_size) {
  auto kernel = std::make_shared<CornerKernel>(kernel_config(gaussian_size == 9 ? 1.5 : 1.0, gaussian_size, 3, 1e-6));
  auto peaks = std::make_shared<std::vector<Peak>>(kSide * kSide / 16 + 1000);
  return [=] {
    for (const SubImage& b : boxes) {
      KernelJob job;
      job.image = view(image);
      job.domain = {0, 0, kSide, kSide};
      job.search = job.mean = PixelRect{b.u0, b.v0, b.u0 + b.width, b.v0 + b.height}.grown(-5);
      job.measure = job.search.grown(3);
      bench::keep(kernel->run(job, *peaks));
    }
  };
}

std::function<void()> detector(const cv::Mat& image, const SubImageSet& boxes, DetectConfig config) {
  auto detect = std::make_shared<CornerDetector>(config, kSide, kSide);
  auto out = std::make_shared<CornerSet>();
  return [=] { detect->detect(view(image), nullptr, boxes, *out); };
}

void race(const char* where, int n_boxes, int type) {
  const cv::Mat image = scene(type);
  const SubImageSet boxes = boxes_of(n_boxes);
  DetectConfig pixels;
  pixels.subpixel_window_px = 0;
  bench::Race race(std::string("corners, ") + where + (type == CV_8U ? ", 8 bit" : ", 12 bit in 16"), pixels_of(boxes), "ns/px", 1e-9);
  race.add("cyclops kernel: 7 taps, Noble, mean, maxima", kernel_alone(image, boxes, 7));
  race.add("cyclops kernel, 9 taps", kernel_alone(image, boxes, 9));
  race.add("cyclops detect, thesis mode", detector(image, boxes, DetectConfig::thesis()));
  race.add("cyclops detect, refined without sub-pixel", detector(image, boxes, pixels));
  race.add("cyclops detect, refined", detector(image, boxes, DetectConfig{}));
  race.add("cv::cornerMinEigenVal block 3 (measure only)", on_each(image, boxes, [](const cv::Mat& m) {
             static cv::Mat out;
             cv::cornerMinEigenVal(m, out, 3);
           }));
  race.add("cv::cornerHarris block 3 (measure only)", on_each(image, boxes, [](const cv::Mat& m) {
             static cv::Mat out;
             cv::cornerHarris(m, out, 3, 3, 0.04);
           }));
  race.add("cv::goodFeaturesToTrack", on_each(image, boxes, [](const cv::Mat& m) {
             static std::vector<cv::Point2f> out;
             cv::goodFeaturesToTrack(m, out, 0, 0.01, 3);
           }));
  race.run();
}

BENCH(detect) {
  cv::setNumThreads(1);
  for (int type : {CV_8U, CV_16U}) {
    race("full frame 1024x1024", 0, type);
    race("11 boxes of 61x61 (3.9 %)", 11, type);
    race("28 boxes of 61x61 (9.9 %)", 28, type);
  }
}

BENCH(subpixel) {
  cv::setNumThreads(1);
  const cv::Mat image = scene(CV_8U);
  DetectConfig config;
  config.subpixel_window_px = 0;
  CornerDetector detect(config, kSide, kSide);
  auto corners = std::make_unique<CornerSet>();
  detect.detect(view(image), nullptr, boxes_of(28), *corners);
  std::vector<cv::Point2f> starts;
  for (const Corner& c : corners->items) starts.emplace_back(static_cast<float>(c.uv_px.x()), static_cast<float>(c.uv_px.y()));
  bench::Race race("sub-pixel refinement of " + std::to_string(starts.size()) + " corners, 8 bit",
                   static_cast<double>(starts.size()), "us/corner", 1e-6);
  SubpixelRefiner refiner({});
  race.add("cyclops, window 4, with covariance", [&] {
    for (const cv::Point2f& p : starts) bench::keep(refiner.refine(view(image), static_cast<int>(p.x), static_cast<int>(p.y), 4));
  });
  for (int window : {3, 4, 5})
    race.add("cv::cornerSubPix, window " + std::to_string(window), [&, window] {
      std::vector<cv::Point2f> points = starts;
      cv::cornerSubPix(image, points, {window, window}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 10, 0.005});
    });
  race.run();
  bench::Race noise("noise of one 61x61 box", 1, "us", 1e-6);
  noise.add("cyclops", [&] { bench::keep(estimate_noise_variance(view(image), {300, 300, 361, 361}, nullptr)); });
  noise.run();
}

/// One pass each, for test/bench/callgrind.sh, which divides the instructions by these pixels.
BENCH(once_full) { kernel_alone(scene(CV_8U), boxes_of(0), 7)(); }
BENCH(once_full_16) { kernel_alone(scene(CV_16U), boxes_of(0), 7)(); }
BENCH(once_boxes) { kernel_alone(scene(CV_8U), boxes_of(28), 7)(); }
BENCH(once_boxes_16) { kernel_alone(scene(CV_16U), boxes_of(28), 7)(); }
BENCH(once_boxes_9) { kernel_alone(scene(CV_8U), boxes_of(28), 9)(); }

}  // namespace
}  // namespace cyclops
