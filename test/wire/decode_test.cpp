#include "wire/decode.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "test/support.hpp"
#include "test/wire/examples.hpp"

namespace cyclops {
namespace {

using test::bytes_of;
using test::expect_error;
using Bytes = std::vector<std::uint8_t>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

void put32(Bytes& b, std::size_t at, std::int32_t v) {
  for (std::size_t i = 0; i < 4; ++i) b[at + i] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(v) >> (24 - 8 * i));
}

TEST(DecodeTspi, GivesBackWhatWasSent) {
  const TspiReport want = test::good_report();
  const Bytes b = bytes_of(test::good_tspi());
  const auto got = decode_tspi(b.data(), b.size(), Aircraft::kTanker);
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got->aircraft, want.aircraft);
  EXPECT_EQ(got->seq, want.seq);
  EXPECT_EQ(got->t_gps, want.t_gps);
  EXPECT_EQ(got->latitude_deg, want.latitude_deg);
  EXPECT_EQ(got->longitude_deg, want.longitude_deg);
  EXPECT_EQ(got->height_m, want.height_m);
  EXPECT_EQ(got->velocity_ned_mps, want.velocity_ned_mps);
  EXPECT_EQ(got->q_n_b.coeffs(), want.q_n_b.coeffs());
  EXPECT_EQ(got->rate_b_rps, want.rate_b_rps);
  EXPECT_EQ(got->position_sigma_m, want.position_sigma_m);
  EXPECT_EQ(got->velocity_sigma_mps, want.velocity_sigma_mps);
  EXPECT_EQ(got->attitude_sigma_rad, want.attitude_sigma_rad);
  EXPECT_FALSE(got->degraded);
}

TEST(DecodeTspi, NamesTheFieldTheValueAndWhatWasExpected) {
  using Change = std::function<void(tspi_t&)>;
  const struct { Change change; const char* what; } cases[] = {
      {[](tspi_t& m) { m.gps_time_ns = -1; }, "gps_time_ns is -1, expected 0 to 4000000000000000000"},
      {[](tspi_t& m) { m.gps_time_ns = INT64_MAX; }, "gps_time_ns is 9223372036854775807, expected"},
      {[](tspi_t& m) { m.aircraft = 0; }, "aircraft is 0, expected 1 on this channel"},
      {[](tspi_t& m) { m.aircraft = -7; }, "aircraft is -7, expected 1 on this channel"},
      {[](tspi_t& m) { m.status = 3; }, "status is 3, expected 0 to 2"},
      {[](tspi_t& m) { m.latitude_deg = kNan; }, "latitude_deg is nan, expected -90 to 90"},
      {[](tspi_t& m) { m.latitude_deg = 90.001; }, "latitude_deg is 90.001, expected -90 to 90"},
      {[](tspi_t& m) { m.longitude_deg = -181; }, "longitude_deg is -181, expected -180 to 180"},
      {[](tspi_t& m) { m.height_m = kInf; }, "height_m is inf, expected -1000 to 30000"},
      {[](tspi_t& m) { m.height_m = 31000; }, "height_m is 31000, expected -1000 to 30000"},
      {[](tspi_t& m) { m.velocity_ned_mps[1] = 501; }, "velocity_ned_mps norm is 522.975382, expected 0 to 500"},
      {[](tspi_t& m) { m.velocity_ned_mps[2] = kNan; }, "velocity_ned_mps norm is nan, expected 0 to 500"},
      {[](tspi_t& m) { m.q_n_b[0] = 0; }, "q_n_b norm is 0.866025404, expected 0.999 to 1.001"},
      {[](tspi_t& m) { m.q_n_b[3] = kInf; }, "q_n_b norm is inf, expected 0.999 to 1.001"},
      {[](tspi_t& m) { m.rate_b_rps[0] = -21; }, "rate_b_rps norm is 21.000031, expected 0 to 20"},
      {[](tspi_t& m) { m.position_sigma_m[2] = -0.1; }, "position_sigma_m is -0.1, expected 0 to 1000"},
      {[](tspi_t& m) { m.velocity_sigma_mps[0] = 101; }, "velocity_sigma_mps is 101, expected 0 to 100"},
      {[](tspi_t& m) { m.attitude_sigma_rad[1] = kNan; }, "attitude_sigma_rad is nan, expected 0 to 3.2"},
  };
  for (const auto& c : cases) {
    tspi_t m = test::good_tspi();
    c.change(m);
    const Bytes b = bytes_of(m);
    expect_error(decode_tspi(b.data(), b.size(), Aircraft::kTanker), ErrorCode::kInvalid, std::string("TSPI_TANKER: ") + c.what);
  }
}

TEST(DecodeTspi, GivesItsOwnCodeToAStateTheSenderCallsInvalid) {
  tspi_t m = test::good_tspi();
  m.status = tspi_t::STATUS_INVALID;
  const Bytes b = bytes_of(m);
  expect_error(decode_tspi(b.data(), b.size(), Aircraft::kTanker), ErrorCode::kUnusable, "TSPI_TANKER: status is INVALID");
}

TEST(DecodeTspi, NormalisesAQuaternionThatIsAlmostUnit) {
  tspi_t m = test::good_tspi();
  for (double& x : m.q_n_b) x *= 1.0009;
  m.status = tspi_t::STATUS_DEGRADED;
  const Bytes b = bytes_of(m);
  const auto got = decode_tspi(b.data(), b.size(), Aircraft::kTanker);
  ASSERT_TRUE(got.ok());
  EXPECT_NEAR(got->q_n_b.norm(), 1, 1e-15);
  EXPECT_TRUE(got->degraded);
}

TEST(DecodeTspi, RefusesAMessageOnTheOtherAircraftsChannel) {
  const Bytes b = bytes_of(test::good_tspi());
  expect_error(decode_tspi(b.data(), b.size(), Aircraft::kReceiver), ErrorCode::kInvalid, "TSPI_RECEIVER: aircraft is 1, expected 0 on this channel");
}

/// Calls the decoder of one kind of message and says how it went.
struct Kind {
  const char* name;
  Bytes good;
  std::function<Result<>(const Bytes&)> decode;
};

template <class R>
Result<> outcome(const R& r) {
  return r.ok() ? Result<>(Ok{}) : Result<>(r.error());
}

std::vector<Kind> kinds() {
  static const std::vector<std::uint8_t> pixels(16 * 20 * 2, 5);
  strobe_edge_t strobe;
  fill(strobe, LineEdge{{{5000}, 12, true}, StrobeLine::kPps});
  time_mark_t mark;
  fill(mark, TimeMark{{5000}, {600}, {20}}, MarkSource::kRecorded);
  frame_index_t frame;
  fill(frame, test::good_frame());
  truth_t truth;
  fill(truth, test::good_truth());
  event_t event;
  fill(event, test::good_event());
  return {
      {"tspi", bytes_of(test::good_tspi()), [](const Bytes& b) { return outcome(decode_tspi(b.data(), b.size(), Aircraft::kTanker)); }},
      {"strobe", bytes_of(strobe), [](const Bytes& b) { return outcome(decode_strobe_edge(b.data(), b.size())); }},
      {"mark", bytes_of(mark), [](const Bytes& b) { return outcome(decode_time_mark(b.data(), b.size())); }},
      {"frame", bytes_of(frame), [](const Bytes& b) { return outcome(decode_frame_index(b.data(), b.size())); }},
      {"data", test::frame_data_bytes(test::good_frame_data(pixels)), [](const Bytes& b) { return outcome(decode_frame_data(b.data(), b.size())); }},
      {"truth", bytes_of(truth), [](const Bytes& b) { Truth t; return decode_truth(b.data(), b.size(), t); }},
      {"event", bytes_of(event), [](const Bytes& b) { return outcome(decode_event(b.data(), b.size())); }},
  };
}

TEST(Decode, TakesAGoodMessageOfEveryKind) {
  for (const Kind& k : kinds()) {
    const auto r = k.decode(k.good);
    EXPECT_TRUE(r.ok()) << k.name << ": " << (r.ok() ? "" : r.error().message());
  }
}

TEST(Decode, CallsEveryShorterMessageTruncated) {
  for (const Kind& k : kinds())
    for (std::size_t n = 0; n < k.good.size(); ++n) {
      const auto r = k.decode(Bytes(k.good.begin(), k.good.begin() + static_cast<std::ptrdiff_t>(n)));
      ASSERT_FALSE(r.ok()) << k.name << " " << n;
      EXPECT_EQ(r.error().code, ErrorCode::kTruncated) << k.name << " " << n << ": " << r.error().message();
    }
}

TEST(Decode, CallsALongerMessageAndAnotherFingerprintCorrupt) {
  for (const Kind& k : kinds()) {
    Bytes longer = k.good;
    longer.push_back(0);
    const auto a = k.decode(longer);
    ASSERT_FALSE(a.ok());
    EXPECT_EQ(a.error().code, ErrorCode::kCorrupt) << a.error().message();
    EXPECT_NE(a.error().what.find("bytes, expected"), std::string::npos);
    Bytes other = k.good;
    other[7] ^= 1;
    const auto b = k.decode(other);
    ASSERT_FALSE(b.ok());
    EXPECT_EQ(b.error().code, ErrorCode::kCorrupt);
    EXPECT_NE(b.error().what.find("fingerprint is "), std::string::npos) << b.error().message();
  }
}

TEST(Decode, DoesNotBelieveTheLengthOfAStringOrArray) {
  const auto all = kinds();
  const struct { std::size_t kind, at; const char* what; } lengths[] = {
      {3, 8 + 7 * 8 + 3 + 6, "FRAME: recorded_in has length"},
      {3, 8 + 7 * 8 + 3 + 6 + 4 + 11 + 8, "FRAME: thumbnail_bytes is"},
      {4, 8 + 3 * 8 + 1 + 4 + 1, "FRAME_DATA: mask_bytes is"},
      {4, 8 + 3 * 8 + 1 + 4 + 1 + 4 + 3, "FRAME_DATA: size_bytes is"},
      {5, 8 + 24 + 1 + 24 + 32 + 24, "TRUTH: n is"},
      {5, 8 + 24 + 1 + 24 + 32 + 24 + 4 + 2 * 21, "TRUTH: n_detail is"},
      {6, 8 + 8 + 1, "EVENT: source has length"},
  };
  for (const auto& l : lengths)
    for (std::int32_t n : {INT32_MIN, -1, 0x7fffffff, 0x10000000}) {
      Bytes b = all[l.kind].good;
      put32(b, l.at, n);
      expect_error(all[l.kind].decode(b), ErrorCode::kCorrupt, l.what);
    }
  Bytes b = all[6].good;
  put32(b, 8 + 8 + 1, 0);  // not even its closing zero
  expect_error(all[6].decode(b), ErrorCode::kCorrupt, "EVENT: source has length 0 with its closing zero, expected 1 to 256");
  b = all[6].good;
  b[8 + 8 + 1 + 4 + 2] = 0;
  expect_error(all[6].decode(b), ErrorCode::kCorrupt, "EVENT: source does not end with its only zero");
}

TEST(Decode, RefusesValuesOutsideTheirEnums) {
  strobe_edge_t s;
  fill(s, LineEdge{});
  s.edge = 2;
  Bytes b = bytes_of(s);
  expect_error(decode_strobe_edge(b.data(), b.size()), ErrorCode::kInvalid, "STROBE: edge is 2, expected 0 to 1");
  s.edge = 1;
  s.line = 9;
  b = bytes_of(s);
  expect_error(decode_strobe_edge(b.data(), b.size()), ErrorCode::kInvalid, "STROBE: line is 9, expected 0 to 1");
  time_mark_t m;
  fill(m, TimeMark{{5}, {6}, {-7}}, MarkSource::kPps);
  b = bytes_of(m);
  expect_error(decode_time_mark(b.data(), b.size()), ErrorCode::kInvalid, "TIME_MARK: sigma_ns is -7, expected 0 to 60000000000");
  frame_index_t f;
  fill(f, test::good_frame());
  f.time_source = 4;
  b = bytes_of(f);
  expect_error(decode_frame_index(b.data(), b.size()), ErrorCode::kInvalid, "FRAME: time_source is 4, expected 0 to 3");
}

TEST(DecodeTruth, GivesBackWhatWasSent) {
  const Truth want = test::good_truth();
  truth_t m;
  fill(m, want);
  const Bytes b = bytes_of(m);
  Truth got;
  ASSERT_TRUE(decode_truth(b.data(), b.size(), got).ok());
  EXPECT_EQ(got.camera_frame_id, want.camera_frame_id);
  EXPECT_EQ(got.t_mid, want.t_mid);
  EXPECT_TRUE(got.has_pose);
  EXPECT_EQ(got.T_r_k.translation().xyz, want.T_r_k.translation().xyz);
  EXPECT_LT((got.T_r_k.rotation().matrix() - want.T_r_k.rotation().matrix()).norm(), 1e-15);
  ASSERT_EQ(got.points.size(), 2u);
  EXPECT_EQ(got.points[1].id, 15);
  EXPECT_EQ(got.points[1].uv_px, want.points[1].uv_px);
  EXPECT_EQ(got.points[1].visibility, TruthVisibility::kDoNotScore);
  EXPECT_EQ(got.exposure, want.exposure);
  EXPECT_EQ(got.sun_c, want.sun_c);
  EXPECT_TRUE(got.has_detail);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(got.points[i].reasons, want.points[i].reasons);
    EXPECT_EQ(got.points[i].ideal_px, want.points[i].ideal_px);
  }
  m.u_px[1] = kNan;
  const Bytes bad = bytes_of(m);
  expect_error(decode_truth(bad.data(), bad.size(), got), ErrorCode::kInvalid, "TRUTH: u_px is nan, expected -1000000 to 1000000");
}

TEST(DecodeTruth, TakesAMessageThatKnowsOnlyPixels) {
  Truth want = test::good_truth();
  want.has_pose = want.has_detail = false;
  want.exposure = {};
  want.sun_c.setZero();
  truth_t m;
  fill(m, want);
  EXPECT_TRUE(m.reasons.empty());
  const Bytes b = bytes_of(m);
  Truth got = test::good_truth();  // what it held before must be gone
  ASSERT_TRUE(decode_truth(b.data(), b.size(), got).ok());
  EXPECT_FALSE(got.has_pose);
  EXPECT_FALSE(got.has_detail);
  EXPECT_EQ(got.exposure.ns, 0);
  EXPECT_EQ(got.sun_c, Vec3(0, 0, 0));
  ASSERT_EQ(got.points.size(), 2u);
  EXPECT_EQ(got.points[1].uv_px, want.points[1].uv_px);
  EXPECT_EQ(got.points[1].reasons, 0u);
}

TEST(DecodeTruth, RefusesDetailsThatCannotBe) {
  Truth got;
  const auto refused = [&](const auto& spoil, ErrorCode code, const char* what) {
    truth_t m;
    fill(m, test::good_truth());
    spoil(m);
    const Bytes b = bytes_of(m);
    expect_error(decode_truth(b.data(), b.size(), got), code, what);
  };
  refused([](truth_t& m) { m.exposure_ns = -1; }, ErrorCode::kInvalid, "TRUTH: exposure_ns is -1, expected 0 to 10000000000");
  refused([](truth_t& m) { m.sun_c[2] = 0.7; }, ErrorCode::kInvalid, "TRUTH: sun_c is neither a unit vector nor zero");
  refused([](truth_t& m) { m.sun_c[2] = kNan; }, ErrorCode::kInvalid, "TRUTH: sun_c norm is nan");
  refused([](truth_t& m) { m.reasons[0] = 512; }, ErrorCode::kInvalid, "TRUTH: reasons is 512, expected 0 to 511");
  refused([](truth_t& m) { m.ideal_v_px[1] = kNan; }, ErrorCode::kInvalid, "TRUTH: ideal_v_px is nan, expected -1000000 to 1000000");
  refused([](truth_t& m) { m.n_detail = 1; }, ErrorCode::kCorrupt, "TRUTH: n_detail is 1, expected 0 or n = 2");
}

TEST(DecodeEvent, GivesBackWhatWasSent) {
  event_t m;
  fill(m, test::good_event());
  const Bytes b = bytes_of(m);
  const auto got = decode_event(b.data(), b.size());
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got->level, EventLevel::kFault);
  EXPECT_EQ(got->source, "tspi.receiver");
  EXPECT_EQ(got->code, "tspi.nan");
  EXPECT_EQ(got->text, "latitude_deg is nan");
  EXPECT_EQ(got->count, 3);
}

TEST(Decode, UsesNoHeapForAGoodMessage) {
  const auto all = kinds();
  Truth truth;
  test::HeapGuard guard;
  EXPECT_TRUE(decode_tspi(all[0].good.data(), all[0].good.size(), Aircraft::kTanker).ok());
  EXPECT_TRUE(decode_frame_data(all[4].good.data(), all[4].good.size()).ok());
  EXPECT_TRUE(decode_truth(all[5].good.data(), all[5].good.size(), truth).ok());
  EXPECT_TRUE(decode_event(all[6].good.data(), all[6].good.size()).ok());
  EXPECT_EQ(guard.count(), 0u);
}

TEST(DecodeMark, TakesItsTextAndRefusesControlCharactersAndTooMuchOfIt) {
  mark_t m;
  fill(m, Mark{7, "boom in contact"});
  const auto good = test::bytes_of(m);
  const auto mark = decode_mark(good.data(), good.size());
  ASSERT_TRUE(mark.ok()) << mark.error().message();
  EXPECT_EQ(mark->seq, 7);
  EXPECT_EQ(mark->text, "boom in contact");
  fill(m, Mark{7, "two\nlines"});
  const auto lines = test::bytes_of(m);
  test::expect_error(decode_mark(lines.data(), lines.size()), ErrorCode::kInvalid, "CYCLOPS_MARK: text holds a control character");
  const std::string much(Mark::kMaxText + 1, 'x');
  fill(m, Mark{7, much});
  const auto too_much = test::bytes_of(m);
  EXPECT_FALSE(decode_mark(too_much.data(), too_much.size()).ok());
}

TEST(DecodeAcquisition, TakesTheLeastTimeAndRefusesOneThatCannotBe) {
  acquisition_t m;
  for (const std::int64_t t : {INT64_MIN, std::int64_t{-5}, kMaxTime_ns}) {
    fill(m, Acquisition{AcquisitionChange::kSilent, Time{t}});
    const auto bytes = test::bytes_of(m);
    const auto a = decode_acquisition(bytes.data(), bytes.size());
    ASSERT_TRUE(a.ok()) << t;
    EXPECT_EQ(a->t.ns, t);
    EXPECT_EQ(a->what, AcquisitionChange::kSilent);
  }
  fill(m, Acquisition{AcquisitionChange::kStarted, Time{INT64_MIN + 1}});
  const auto bytes = test::bytes_of(m);
  EXPECT_FALSE(decode_acquisition(bytes.data(), bytes.size()).ok());
}

}  // namespace
}  // namespace cyclops
