#include "wire/encode.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "test/support.hpp"
#include "test/wire/examples.hpp"

namespace cyclops {
namespace {

using test::bytes_of;

/// Through the bytes with the generated encoder and decoder.
template <class Message>
Message received(const Message& sent) {
  const auto b = bytes_of(sent);
  Message got;
  EXPECT_EQ(got.decode(b.data(), 0, static_cast<int>(b.size())), static_cast<int>(b.size()));
  return got;
}

RelativeState relative() {
  RelativeState s;
  s.t = {1000};
  s.valid = true;
  s.extrapolated = true;
  s.age_receiver = {5};
  s.age_tanker = {-6};
  s.T_r_k = Pose<frame::R, frame::K>(Rotation<frame::R, frame::K>(so3_exp({0.1, -0.2, 0.3})), Point<frame::R>(33, 0.1, -5));
  for (int i = 0; i < 36; ++i) s.covariance(i / 6, i % 6) = i;
  return s;
}

Mat2 mat2(double a, double b, double c) {
  Mat2 m;
  m << a, b, b, c;
  return m;
}

TEST(Encode, NavState) {
  nav_state_t m;
  fill(m, 12, relative(), NavAbsence::kNone, true);
  const auto got = received(m);
  EXPECT_EQ(got.seq, 12);
  EXPECT_EQ(got.mid_exposure_ns, 1000);
  EXPECT_TRUE(got.valid && got.used && got.extrapolated);
  EXPECT_EQ(got.absence, 0);
  EXPECT_EQ(got.age_receiver_ns, 5);
  EXPECT_EQ(got.age_tanker_ns, -6);
  EXPECT_EQ(got.t_r_k_m[2], -5);
  EXPECT_EQ(got.q_r_k[0], relative().T_r_k.rotation().quaternion().w());
  EXPECT_EQ(got.covariance[8], 8);  // row 1, column 2
  fill(m, 13, RelativeState{}, NavAbsence::kTooOldTanker, false);
  EXPECT_FALSE(received(m).valid);
  EXPECT_EQ(received(m).absence, 5);
}

TEST(Encode, PredictionSet) {
  PredictionSet set;
  set.seq = 4;
  set.t_mid = {99};
  set.from_nav = true;
  Prediction p;
  p.id = 15;
  p.visibility = Visibility::kFacingAway;
  p.uv_px = {816.5, 613.25};
  p.cov_px2 = mat2(4, 1, 9);
  set.items = {p, p};
  const float gates[] = {6.5F, 13};
  const RelativeState nav = relative();
  prediction_set_t m;
  fill(m, set, &nav, 31.5, gates);
  const auto got = received(m);
  EXPECT_EQ(got.seq, 4);
  EXPECT_TRUE(got.from_nav && got.nav_extrapolated);
  EXPECT_EQ(got.t_r_k_m[0], 33);
  EXPECT_EQ(got.range_m, 31.5F);
  ASSERT_EQ(got.n, 2);
  EXPECT_EQ(got.items[0].visibility, prediction_t::FACING_AWAY);
  EXPECT_EQ(got.items[0].uv_px[1], 613.25F);
  EXPECT_EQ(got.items[0].cov_px2[1], 1);
  EXPECT_EQ(got.items[1].gate_px, 13);
  fill(m, set, nullptr, -1, {});
  EXPECT_EQ(received(m).t_r_k_m[0], 0);
  EXPECT_EQ(received(m).q_r_k[0], 1);
  EXPECT_EQ(received(m).items[0].gate_px, 0);
}

TEST(Encode, SubImageSet) {
  const SubImageSet set{{10, 20, 100, 50, 3}, {200, 300, 10, 10, 1}};
  subimage_set_t m;
  fill(m, 4, {99}, set, 1024 * 1024);
  const auto got = received(m);
  ASSERT_EQ(got.n, 2);
  EXPECT_EQ(got.u0_px[1], 200);
  EXPECT_EQ(got.v0_px[0], 20);
  EXPECT_EQ(got.width_px[0], 100);
  EXPECT_EQ(got.height_px[0], 50);
  EXPECT_FLOAT_EQ(got.area_share, 5100.0F / (1024 * 1024));
}

TEST(Encode, CornerSetListsTheStrongestFirst) {
  auto set = std::make_unique<CornerSet>();
  set->overflow = 5;
  for (int i = 0; i < 1000; ++i) {
    Corner c;
    c.uv_px = {1.0 * i, 2.0 * i};
    c.measure = static_cast<float>(i * 7 % 1000 / 2);  // every value twice
    c.cov_px2 = mat2(0.25, 0, 0.04);
    set->items.push_back(c);
  }
  corner_set_t m;
  fill(m, *set, 100);
  const auto got = received(m);
  EXPECT_EQ(got.found, 1005);
  EXPECT_EQ(got.overflow, 5);
  ASSERT_EQ(got.n, 100);
  EXPECT_EQ(got.measure[0], 499);
  EXPECT_EQ(got.measure[99], 450);
  for (int i = 1; i < 100; ++i) {
    EXPECT_GE(got.measure[i - 1], got.measure[i]);
    if (got.measure[i - 1] == got.measure[i]) { EXPECT_LT(got.u_px[i - 1], got.u_px[i]); }
  }
  EXPECT_FLOAT_EQ(got.sigma_px[0], 0.5);
}

TEST(Encode, TrackSet) {
  Track t;
  t.id = 9;
  t.state = TrackState::kCoasting;
  t.change = TrackChange::kMiss;
  t.uv_px = {1, 2};
  t.velocity_px_s = {3, -4};
  t.score = 100000;
  t.t_last_hit = {55};
  track_set_t m;
  fill(m, 4, {99}, TrackSet{t});
  const auto got = received(m);
  ASSERT_EQ(got.n, 1);
  EXPECT_EQ(got.items[0].state, track_t::COASTING);
  EXPECT_EQ(got.items[0].change, track_t::MISS);
  EXPECT_EQ(got.items[0].velocity_px_s[1], -4);
  EXPECT_EQ(got.items[0].score, 32767);
  EXPECT_EQ(got.items[0].last_hit_ns, 55);
}

TEST(Encode, MeasurementSetCountsWhatIsPartOfZ) {
  MeasurementSet set;
  set.seq = 4;
  set.t_mid = {99};
  set.t_mid_sigma = {7};
  set.integrity = 0.5;
  Measurement a;
  a.id = 15;
  a.accepted = true;
  a.z_m = {-3.662666e-3, -1.227000e-3};
  a.innovation_cov_px2 = mat2(4, 1, 9);
  a.nis = 2.5;
  Measurement b;
  b.reason = MatchReason::kLostToOther;
  set.items = {a, b};
  measurement_set_t m;
  fill(m, set, TimeSource::kArrival, GpsTime{1234});
  const auto got = received(m);
  EXPECT_EQ(got.accepted, 1);
  ASSERT_EQ(got.n, 2);
  EXPECT_EQ(got.mid_exposure_gps_ns, 1234);
  EXPECT_EQ(got.mid_exposure_sigma_ns, 7);
  EXPECT_EQ(got.time_source, 2);
  EXPECT_EQ(got.items[0].z_m[0], -3.662666e-3);
  EXPECT_EQ(got.items[0].innovation_cov_px2[2], 9);
  EXPECT_EQ(got.items[0].nis, 2.5);
  EXPECT_EQ(got.items[1].reason, measurement_t::LOST_TO_OTHER);
  fill(m, set, TimeSource::kStrobe, std::nullopt);
  EXPECT_EQ(received(m).mid_exposure_gps_ns, 0);
}

TEST(Encode, StrobeAndTimeMarkComeBackThroughTheDecoders) {
  strobe_edge_t s;
  fill(s, LineEdge{{{5000}, 12, false}, StrobeLine::kPps});
  const auto sb = bytes_of(s);
  const auto edge = decode_strobe_edge(sb.data(), sb.size());
  ASSERT_TRUE(edge.ok());
  EXPECT_EQ(edge->edge.t.ns, 5000);
  EXPECT_EQ(edge->edge.line_seq, 12);
  EXPECT_FALSE(edge->edge.rising);
  EXPECT_EQ(edge->line, StrobeLine::kPps);
  time_mark_t m;
  fill(m, TimeMark{{-5000}, {600}, {20}}, MarkSource::kTspiArrival);
  const auto mb = bytes_of(m);
  const auto mark = decode_time_mark(mb.data(), mb.size());
  ASSERT_TRUE(mark.ok());
  EXPECT_EQ(mark->mark.t.ns, -5000);
  EXPECT_EQ(mark->mark.t_gps.ns, 600);
  EXPECT_EQ(mark->mark.sigma.ns, 20);
  EXPECT_EQ(mark->source, MarkSource::kTspiArrival);
}

TEST(Encode, SaysWhenTheRoomIsTooSmall) {
  std::vector<std::uint8_t> small(20), pixels(640);
  EXPECT_FALSE(encode_into(test::good_tspi(), small));
  EXPECT_FALSE(encode_into(test::good_frame_data(pixels), small));
}

TEST(Encode, UsesNoHeapFromTheFirstFrameOn) {
  // GIVEN the largest sets there can be
  auto predictions = std::make_unique<PredictionSet>();
  auto corners = std::make_unique<CornerSet>();
  auto tracks = std::make_unique<TrackSet>();
  auto measurements = std::make_unique<MeasurementSet>();
  auto boxes = std::make_unique<SubImageSet>();
  predictions->items.resize(kMaxFeatures);
  corners->items.resize(kMaxCorners);
  tracks->resize(kMaxFeatures);
  measurements->items.resize(kMaxFeatures);
  boxes->resize(kMaxSubImages);
  const RelativeState nav = relative();
  const FrameIndex frame = test::good_frame();
  Outbox out;
  std::vector<std::uint8_t> room(kMaxMessageBytes);
  // WHEN they are filled and encoded, THEN no memory is taken
  test::HeapGuard guard;
  for (int i = 0; i < 3; ++i) {
    fill(out.frame, frame);
    fill(out.nav, 1, nav, NavAbsence::kNone, true);
    fill(out.prediction, *predictions, &nav, 30, {});
    fill(out.subimage, 1, {}, *boxes, 1024 * 1024);
    fill(out.corner, *corners);
    fill(out.track, 1, {}, *tracks);
    fill(out.measurement, *measurements, TimeSource::kStrobe, std::nullopt);
    fill(out.event, test::good_event());
    EXPECT_TRUE(encode_into(out.frame, room) && encode_into(out.nav, room) && encode_into(out.prediction, room) && encode_into(out.subimage, room));
    EXPECT_TRUE(encode_into(out.corner, room) && encode_into(out.track, room) && encode_into(out.measurement, room) && encode_into(out.event, room));
    EXPECT_EQ(guard.count(), 0u);
  }
}

}  // namespace
}  // namespace cyclops
