/// Peer: goodFeaturesToTrack, nearest neighbour within 13 px of navigation's prediction and cornerSubPix at navigation updates; pyramidal
/// Lucas-Kanade between them. What a careful user of OpenCV would write in a day.
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "tools/peers/peer.hpp"

namespace {

using namespace cyclops;
using namespace cyclops::peers;

constexpr double kGate_px = 13;        // spec 4.2, with projection error
constexpr int kMaxCorners = 2000;
constexpr double kQuality = 0.01, kApart_px = 3;
constexpr int kMargin_px = 25;         // searched about a prediction

class OpenCvPeer final : public Peer {
 public:
  void step(const Rig&, const FrameOutput& in, const cv::Mat& grey, std::vector<Found>& out) override {
    if (in.in.nav.state.valid) find(in.predictions, grey);
    else follow(grey);
    grey.copyTo(last_);
    for (std::size_t i = 0; i < ids_.size(); ++i) out.push_back({ids_[i], Vec2(points_[i].x, points_[i].y)});
  }

 private:
  void find(const PredictionSet& predictions, const cv::Mat& grey) {
    ids_.clear();
    points_.clear();
    mask_ = cv::Mat::zeros(grey.size(), CV_8U);
    for (const Prediction& p : predictions.items)
      if (p.visibility == Visibility::kVisible)
        cv::rectangle(mask_, cv::Point(static_cast<int>(p.uv_px.x()) - kMargin_px, static_cast<int>(p.uv_px.y()) - kMargin_px),
                      cv::Point(static_cast<int>(p.uv_px.x()) + kMargin_px, static_cast<int>(p.uv_px.y()) + kMargin_px), 255, cv::FILLED);
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey, corners, kMaxCorners, kQuality, kApart_px, mask_);
    for (const Prediction& p : predictions.items) {
      if (p.visibility != Visibility::kVisible) continue;
      double best = kGate_px;
      const cv::Point2f* nearest = nullptr;
      for (const cv::Point2f& c : corners)
        if (const double d = std::hypot(c.x - p.uv_px.x(), c.y - p.uv_px.y()); d < best) best = d, nearest = &c;
      if (nearest == nullptr) continue;
      ids_.push_back(p.id);
      points_.push_back(*nearest);
    }
    if (!points_.empty()) cv::cornerSubPix(grey, points_, {3, 3}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.01});
  }

  void follow(const cv::Mat& grey) {
    if (points_.empty() || last_.empty()) return;
    std::vector<cv::Point2f> moved;
    std::vector<std::uint8_t> good;
    cv::calcOpticalFlowPyrLK(last_, grey, points_, moved, good, cv::noArray());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      if (good[i] == 0 || moved[i].x < 0 || moved[i].y < 0 || moved[i].x > static_cast<float>(grey.cols - 1) || moved[i].y > static_cast<float>(grey.rows - 1)) continue;
      ids_[kept] = ids_[i];
      points_[kept++] = moved[i];
    }
    ids_.resize(kept);
    points_.resize(kept);
  }

  std::vector<FeatureId> ids_;
  std::vector<cv::Point2f> points_;
  cv::Mat mask_, last_;
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "Peer: OpenCV's corners, nearest neighbour, sub-pixel; Lucas-Kanade between navigation updates.", [](const Rig&) { return std::make_unique<OpenCvPeer>(); });
}
