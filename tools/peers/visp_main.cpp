/// Peer: ViSP's model-based edge tracker (moving edges, virtual visual servoing) on the tanker's sharp edges. It starts at navigation's
/// pose, then follows by itself; it starts again at an update when it has lost the object or is further from navigation than 5 m or
/// 10 degrees. Its measurements are the features of the model at its pose.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <unistd.h>

#include "tools/peers/peer.hpp"
#include "tools/peers/visp_edges.hpp"
#include "tools/peers/wire_model.hpp"

namespace {

using namespace cyclops;
using namespace cyclops::peers;
using PoseCK = Pose<frame::C, frame::K>;

constexpr double kFar_m = 5, kFar_rad = 10 * std::numbers::pi / 180;

Matrix34 rows(const PoseCK& T) {
  Matrix34 out{};
  const Mat3 R = T.rotation().matrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = R(i, j);
    out[static_cast<std::size_t>(i)][3] = T.translation().xyz[i];
  }
  return out;
}

PoseCK pose(const Matrix34& M) {
  Mat3 R;
  Vec3 t;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = M[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    t[i] = M[static_cast<std::size_t>(i)][3];
  }
  return {Rotation<frame::C, frame::K>(R), Point<frame::C>(t)};
}

std::array<double, 3> xyz(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

std::unique_ptr<VispEdges> tracker(const Rig& rig) {
  const WireModel model = wire_model(rig.tanker);
  std::vector<Segment> edges;
  for (const auto& f : model.faces)
    for (std::size_t i = 0; i < f.corner.size(); ++i)
      if (f.edge[i]) edges.push_back({xyz(model.points_k[f.corner[i]]), xyz(model.points_k[f.corner[(i + 1) % f.corner.size()]])});
  const auto path = std::filesystem::temp_directory_path() / ("cyclops-peer-" + std::to_string(getpid()) + ".cao");
  std::ofstream(path) << as_cao(model);
  const Intrinsics& k = rig.camera.intrinsics();
  auto out = std::make_unique<VispEdges>(path.string(), edges, k.fx_px, k.fy_px, k.cx_px, k.cy_px);
  std::filesystem::remove(path);
  return out;
}

class VispPeer final : public Peer {
 public:
  explicit VispPeer(const Rig& rig)
      : mount_{camera_from_receiver(rig.mount_angles), rig.lens, rig.boresight_sigma_rad}, T_c_r_(mount_.R_c_r, Point<frame::C>(-mount_.R_c_r.rotate(rig.lens.xyz))), tracker_(tracker(rig)) {}

  void step(const Rig& rig, const FrameOutput& in, const cv::Mat& grey, std::vector<Found>& out) override {
    const auto width = static_cast<unsigned>(grey.cols), height = static_cast<unsigned>(grey.rows);
    if (tracking_) tracking_ = tracker_->track(grey.data, width, height);
    if (in.in.nav.state.valid) {
      const PoseCK navigation = T_c_r_ * in.in.nav.state.T_r_k;
      if (!tracking_ || far(pose(tracker_->pose()), navigation)) tracking_ = tracker_->start(grey.data, width, height, rows(navigation));
    }
    if (!tracking_) return;
    RelativeState state;
    state.valid = true;
    state.T_r_k = T_c_r_.inverse() * pose(tracker_->pose());
    predict(state, rig.tanker, rig.camera, mount_, {}, predictions_);
    for (const Prediction& p : predictions_.items)
      if (p.visibility == Visibility::kVisible) out.push_back({p.id, p.uv_px});
  }

 private:
  static bool far(const PoseCK& a, const PoseCK& b) {
    return (a.translation() - b.translation()).norm() > kFar_m || a.rotation().quaternion().angularDistance(b.rotation().quaternion()) > kFar_rad;
  }

  CameraMount mount_;
  Pose<frame::C, frame::R> T_c_r_;
  std::unique_ptr<VispEdges> tracker_;
  PredictionSet predictions_;
  bool tracking_{false};
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "Peer: ViSP's model-based edge tracker.", [](const Rig& rig) { return std::make_unique<VispPeer>(rig); });
}
