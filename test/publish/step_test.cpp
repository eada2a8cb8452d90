// The stages from prediction to Z(t) one after the other: no heap, and the same bits every time.
#include <gtest/gtest.h>

#include <cstring>
#include <memory>

#include "associate/associate.hpp"
#include "publish/measure.hpp"
#include "test/scene.hpp"
#include "test/support.hpp"
#include "track/tracker.hpp"

namespace cyclops {
namespace {

/// `n` features spread over a wing-sized plate.
TankerModel plate(int n) {
  test::Random random(41);
  std::uniform_real_distribution<double> side(-300, 300);
  std::string csv = "id,x,y,z,normals\n";
  for (int i = 0; i < n; ++i)
    csv += std::to_string(i + 1) + "," + std::to_string(side(random)) + "," + std::to_string(side(random)) + "," + std::to_string(side(random) / 3) + ",1 0 -0.5\n";
  return TankerModel::parse(csv, "plate", 0.0254, {0, 0, 0}).value();
}

class Step {
 public:
  Step(int features, Gate gate) : model_(plate(features)), camera_(intrinsics(), test::example_windscreen()) {
    AssociateConfig config;
    config.gate = gate;
    associator_ = std::make_unique<Associator>(config);
  }
  /// One frame; every tenth with navigation. Corners: most features a little off, and clutter.
  void run(int frame) {
    auto state = test::relative_state({2, -1, 3}, {33 - 0.01 * frame, 0.1, -5});
    state.t = Time{} + Duration::from_ms(33) * frame;
    state.covariance.diagonal() << 1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3;
    predict(state, model_, camera_, mount_, {}, *predictions_);
    corners_->t_mid = state.t;
    corners_->items.clear();
    for (const Prediction& p : predictions_->items)
      if (p.visibility == Visibility::kVisible && noise_(random_) > -1) add_corner(p.uv_px + Vec2(noise_(random_), noise_(random_)));
    for (int i = 0; i < 3000; ++i) add_corner({place_(random_), place_(random_)});
    const test::HeapGuard guard;
    predict(state, model_, camera_, mount_, {}, *predictions_);
    tracker_->begin_frame(state.t);
    if (frame % 10 == 0) tracker_->nav_update(*predictions_);
    associator_->associate(tracker_->tracks(), *corners_, *matches_);
    tracker_->update(*matches_, *corners_);
    measure(tracker_->predicted(), *matches_, *corners_, camera_, {}, *out_);
    z_matrix(*out_, (state.t - Time{}).seconds(), *z_);
    heap_uses_ += guard.count();
  }
  [[nodiscard]] std::uint64_t heap_uses() const { return heap_uses_; }
  [[nodiscard]] const ZMatrix& z() const { return *z_; }

 private:
  static Intrinsics intrinsics() {
    Intrinsics k;
    k.k1 = -0.1;
    return k;
  }
  void add_corner(const Vec2& uv) {
    if (!camera_.inside(uv)) return;
    Corner c;
    c.uv_px = uv;
    c.cov_px2 = Mat2::Identity() * 0.25;
    corners_->items.push_back(c);
  }
  TankerModel model_;
  Camera camera_;
  CameraMount mount_{test::example_mount()};
  test::Random random_{42};
  std::normal_distribution<double> noise_{0, 0.7};
  std::uniform_real_distribution<double> place_{0, 1023};
  std::unique_ptr<PredictionSet> predictions_{std::make_unique<PredictionSet>()};
  std::unique_ptr<CornerSet> corners_{std::make_unique<CornerSet>()};
  std::unique_ptr<MatchSet> matches_{std::make_unique<MatchSet>()};
  std::unique_ptr<Associator> associator_;
  std::unique_ptr<Tracker> tracker_{std::make_unique<Tracker>(TrackConfig{}, 1024, 1024)};
  std::unique_ptr<MeasurementSet> out_{std::make_unique<MeasurementSet>()};
  std::unique_ptr<ZMatrix> z_{std::make_unique<ZMatrix>()};
  std::uint64_t heap_uses_{0};
};

TEST(Step, UsesNoHeapWithAThousandAndTwentyFourFeatures) {
  for (const Gate gate : {Gate::kFixed, Gate::kMahalanobis}) {
    Step step(1024, gate);
    for (int frame = 0; frame < 25; ++frame) step.run(frame);
    EXPECT_EQ(step.heap_uses(), 0U);
    EXPECT_GT(step.z().size(), 400U);
  }
}

TEST(Step, GivesTheSameBitsTwice) {
  for (const Gate gate : {Gate::kFixed, Gate::kMahalanobis}) {
    Step a(200, gate), b(200, gate);
    for (int frame = 0; frame < 25; ++frame) {
      a.run(frame);
      b.run(frame);
      ASSERT_EQ(a.z().size(), b.z().size());
      for (std::size_t i = 0; i < a.z().size(); ++i) ASSERT_EQ(std::memcmp(&a.z()[i], &b.z()[i], sizeof a.z()[i]), 0);
    }
  }
}

}  // namespace
}  // namespace cyclops
