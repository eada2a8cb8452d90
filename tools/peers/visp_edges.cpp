#include "tools/peers/visp_edges.hpp"

#include <visp3/mbt/vpMbEdgeTracker.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cyclops::peers {
namespace {

constexpr std::size_t kFewEdges = 200;  // up to here what hides what is worked out line by line; above, a face hides only itself
using Grid = std::array<long, 3>;
using Key = std::array<Grid, 2>;

Key key(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const auto grid = [](const std::array<double, 3>& p) { return Grid{std::lround(p[0] * 1e5), std::lround(p[1] * 1e5), std::lround(p[2] * 1e5)}; };
  return {std::min(grid(a), grid(b)), std::max(grid(a), grid(b))};
}

}  // namespace

class VispEdges::Tracker final : public vpMbEdgeTracker {
 public:
  std::set<Key> edges;
  vpImage<unsigned char> image;

  void take(const std::uint8_t* pixels, unsigned width, unsigned height) {
    image.resize(height, width);
    std::copy_n(pixels, std::size_t{width} * height, image.bitmap);
  }

 protected:
  void initFaceFromCorners(vpMbtPolygon& polygon) override {
    const unsigned n = polygon.getNbPoint();
    polygon.setIsPolygonOriented(true);
    for (unsigned i = 0; i < n; ++i) {
      vpPoint &a = polygon.p[i], &b = polygon.p[(i + 1) % n];
      if (edges.count(key({a.get_oX(), a.get_oY(), a.get_oZ()}, {b.get_oX(), b.get_oY(), b.get_oZ()})) > 0) addLine(a, b, polygon.getIndex(), polygon.getName());
    }
  }
};

VispEdges::VispEdges(const std::string& cao, const std::vector<Segment>& edges, double fx, double fy, double cx, double cy) : tracker_(std::make_unique<Tracker>()) {
  for (const Segment& s : edges) tracker_->edges.insert(key(s[0], s[1]));
  vpCameraParameters camera;
  camera.initPersProjWithoutDistortion(fx, fy, cx, cy);
  tracker_->setCameraParameters(camera);
  vpMe me;
  me.setMaskSize(5);
  me.setMaskNumber(180);
  me.setRange(8);
  me.setThreshold(5000);
  me.setMu1(0.5);
  me.setMu2(0.5);
  me.setSampleStep(4);
  tracker_->setMovingEdge(me);
  tracker_->setAngleAppear(vpMath::rad(85));
  tracker_->setAngleDisappear(vpMath::rad(89));
  tracker_->setNearClippingDistance(0.01);
  tracker_->setFarClippingDistance(2000);
  tracker_->setScanLineVisibilityTest(edges.size() < kFewEdges);
  tracker_->loadModel(cao);
}

VispEdges::~VispEdges() = default;

bool VispEdges::start(const std::uint8_t* pixels, unsigned width, unsigned height, const Matrix34& T) {
  tracker_->take(pixels, width, height);
  vpHomogeneousMatrix M;
  for (unsigned i = 0; i < 3; ++i)
    for (unsigned j = 0; j < 4; ++j) M[i][j] = T[i][j];
  try {
    tracker_->initFromPose(tracker_->image, M);
    tracker_->track(tracker_->image);
  } catch (const vpException&) {
    return false;
  }
  return true;
}

bool VispEdges::track(const std::uint8_t* pixels, unsigned width, unsigned height) {
  tracker_->take(pixels, width, height);
  try {
    tracker_->track(tracker_->image);
  } catch (const vpException&) {
    return false;
  }
  return true;
}

Matrix34 VispEdges::pose() const {
  const vpHomogeneousMatrix M = tracker_->getPose();
  Matrix34 out{};
  for (unsigned i = 0; i < 3; ++i)
    for (unsigned j = 0; j < 4; ++j) out[i][j] = M[i][j];
  return out;
}

}  // namespace cyclops::peers
