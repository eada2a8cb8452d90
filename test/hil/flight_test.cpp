// What a generated flight says beside its pictures: camera, truth and order of arrival.
#include "hil/flight.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "base/file.hpp"
#include "hil/flight_scene.hpp"
#include "record/flight.hpp"
#include "service/rig.hpp"
#include "test/support.hpp"
#include "wire/codec.hpp"

namespace cyclops::hil {
namespace {

Scenario small_scenario() {
  Scenario s = Scenario::load("config/scenarios/embedded.toml").value();
  s.frames = 3;
  return s;
}

std::string fly(const Scenario& s, const test::TempDir& dir) {
  FlightOptions options;
  options.out = dir.file("flight");
  options.threads = 2;
  const auto report = make_flight(s, options);
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message());
  return options.out;
}

template <class Use>
void each_message(const std::string& folder, const Use& use) {
  auto flight = FlightReader::open(folder).value();
  record::LogEvent event;
  while (flight.next(event).value()) use(event);
}

/// Every truth point is where the rig that lies beside it puts it.
double worst_px(const std::string& folder, int& points) {
  const Rig rig = Rig::load(folder + "/rig.toml").value();
  const auto R_c_r = camera_from_receiver(rig.mount_angles);
  const Pose<frame::C, frame::R> T_c_r(R_c_r, Point<frame::C>(-R_c_r.rotate(rig.lens.xyz)));
  double worst = 0;
  points = 0;
  each_message(folder, [&](const record::LogEvent& e) {
    if (e.channel != channel::kTruth) return;
    Truth truth;
    ASSERT_TRUE(decode_truth(e.data.data(), e.data.size(), truth).ok());
    for (const TruthPoint& p : truth.points)
      for (const Feature& f : rig.tanker.features())
        if (f.id == p.id)
          if (const auto uv = rig.camera.project(T_c_r * truth.T_r_k * rig.tanker.in_body(f))) worst = std::max(worst, (*uv - p.uv_px).norm()), ++points;
  });
  return worst;
}

TEST(GeneratedFlight, RigFileAndTruePoseGiveTheTruePixels) {
  const test::TempDir dir;
  Scenario s = small_scenario();
  s.navigation.is_true = true;
  int points = 0;
  EXPECT_LT(worst_px(fly(s, dir), points), 1e-6);
  EXPECT_EQ(points, 3 * 38);
}

TEST(GeneratedFlight, CarriesItsWindscreenAndWholeLens) {
  const test::TempDir dir;
  Scenario s = small_scenario();
  s.navigation.is_true = true;
  s.windscreen = 1;
  s.camera.k1 = -0.05, s.camera.p1 = 1e-3, s.camera.p2 = -2e-3, s.camera.k3 = 0.01;
  const std::string folder = fly(s, dir);
  int points = 0;
  EXPECT_LT(worst_px(folder, points), 1e-6);
  const Rig rig = Rig::load(folder + "/rig.toml").value();
  EXPECT_FALSE(rig.camera.windscreen().empty());
  EXPECT_EQ(rig.camera.intrinsics().p2, -2e-3);
  EXPECT_EQ(FlightReader::open(folder)->manifest().files.count("windscreen.bin"), 1U);
}

TEST(GeneratedFlight, TellsTheRigAWindscreenThatIsNearlyRight) {
  // GIVEN the scenario behind a windscreen that was calibrated in front of a wall
  const test::TempDir dir;
  Scenario s = Scenario::load("config/scenarios/windscreen.toml").value();
  s.frames = 3;
  s.navigation.is_true = true;
  // THEN pose and rig file put the features beside where they are seen, by the error of the calibration
  int points = 0;
  const double worst = worst_px(fly(s, dir), points);
  EXPECT_EQ(points, 3 * 38);
  EXPECT_GT(worst, 0.4);
  EXPECT_LT(worst, 3);
}

TEST(GeneratedFlight, TspiArrivesTenToTwentyMillisecondsLateAndInOrder) {
  const test::TempDir dir;
  double low = 1e9, high = 0;
  std::int64_t last_time = 0, last_seq[2] = {-1, -1};
  Scenario s = small_scenario();
  s.navigation.link_latency_ms = s.navigation.dropouts_per_minute = s.navigation.duplicate_share = s.navigation.swapped_share = 0;
  each_message(fly(s, dir), [&](const record::LogEvent& e) {
    EXPECT_GE(e.time_us, last_time);
    last_time = e.time_us;
    for (const Aircraft a : {Aircraft::kReceiver, Aircraft::kTanker})
      if (e.channel == channel::tspi(a)) {
        const auto r = decode_tspi(e.data.data(), e.data.size(), a).value();
        const double latency_ms = static_cast<double>(e.time_us) * 1e-3 - 1e6 - static_cast<double>(r.t_gps.ns - 1'400'000'000'000'000'000) * 1e-6;
        low = std::min(low, latency_ms), high = std::max(high, latency_ms);
        EXPECT_EQ(r.seq, last_seq[static_cast<int>(a)] + 1);
        last_seq[static_cast<int>(a)] = r.seq;
      }
  });
  EXPECT_GE(low, 9.99);
  EXPECT_LE(high, 20.01);
  EXPECT_GT(high - low, 5);
}

TEST(GeneratedFlight, LeavesFeaturesAtTheBorderOutOfScoring) {
  // GIVEN a flight whose picture ends 1.5 px beside feature 10
  const test::TempDir dir;
  Scenario s = small_scenario();
  s.frames = 1;
  std::map<int, TruthPoint> full, cut;
  const auto read = [&](const std::string& folder, std::map<int, TruthPoint>& out) {
    each_message(folder, [&](const record::LogEvent& e) {
      if (e.channel != channel::kTruth) return;
      Truth truth;
      ASSERT_TRUE(decode_truth(e.data.data(), e.data.size(), truth).ok());
      for (const TruthPoint& p : truth.points) out[p.id] = p;
    });
  };
  read(fly(s, dir), full);
  ASSERT_EQ(full[10].visibility, TruthVisibility::kVisible);
  s.camera.width = static_cast<int>(full[10].uv_px.x() + 2.5);  // the principal point stays
  const test::TempDir other;
  read(fly(s, other), cut);
  // THEN its place is known all the same, and it is not scored
  EXPECT_EQ(cut[10].visibility, TruthVisibility::kDoNotScore);
  EXPECT_LT((cut[10].uv_px - full[10].uv_px).norm(), 0.01);
}

/// Flies two frames of a scenario with that mesh and that feature table; "flown" or the error.
std::string flown_with(const test::TempDir& dir, const std::string& mesh, const std::string& table) {
  std::ofstream(dir.file("own.obj")) << mesh;
  std::ofstream(dir.file("own.csv")) << table;
  const std::string heavy = std::filesystem::absolute("config/scenarios/heavy.toml").string();
  std::ofstream(dir.file("own.toml")) << "base = \"" << heavy << "\"\nname = \"own\"\nframes = 2\n[tanker]\nmodel = \"own.csv\"\nmesh = \"own.obj\"\n";
  FlightOptions options;
  options.out = dir.file("flight");
  options.threads = 2;
  const auto s = Scenario::load(dir.file("own.toml"));
  if (!s.ok()) return s.error().message();
  const auto report = make_flight(*s, options);
  return report.ok() ? "flown" : report.error().message();
}

TEST(GeneratedFlight, TakesAUsersMeshAndFeatureTable) {
  // GIVEN a tanker that no code knows, by its mesh and its table
  const test::TempDir dir;
  const std::string table = read_file("config/heavy/tanker.csv").value();
  ASSERT_EQ(flown_with(dir, read_file("config/heavy/tanker.obj").value(), table), "flown");
  // THEN the flight carries that table, and most of its features are seen
  const Rig rig = Rig::load(dir.file("flight") + "/rig.toml").value();
  EXPECT_EQ(rig.tanker.features().size(), 36U);
  EXPECT_EQ(read_file(dir.file("flight") + "/tanker.csv").value(), table);
  int visible = 0;
  each_message(dir.file("flight"), [&](const record::LogEvent& e) {
    if (e.channel != channel::kTruth) return;
    Truth truth;
    ASSERT_TRUE(decode_truth(e.data.data(), e.data.size(), truth).ok());
    for (const TruthPoint& p : truth.points) visible += p.visibility == TruthVisibility::kVisible;
  });
  EXPECT_GT(visible, 2 * 18);
}

TEST(GeneratedFlight, RefusesAMeshThatIsOpenOrLacksAFeatureNamingFileAndPlace) {
  const test::TempDir open, off;
  const std::string mesh = read_file("config/heavy/tanker.obj").value(), table = read_file("config/heavy/tanker.csv").value();
  const std::string hole = flown_with(open, mesh.substr(0, mesh.rfind("\nf ") + 1), table);  // its last face is missing
  EXPECT_NE(hole.find(open.file("own.obj")), std::string::npos) << hole;
  EXPECT_NE(hole.find("is not closed: the edge from x "), std::string::npos) << hole;
  const std::string lost = flown_with(off, mesh, table + "77,nowhere near,1000,0,900,corner,,0.1,1,invented\n");
  EXPECT_NE(lost.find(off.file("own.csv")), std::string::npos) << lost;
  EXPECT_NE(lost.find(off.file("own.obj")), std::string::npos) << lost;
  EXPECT_NE(lost.find("feature 77 \"nowhere near\" at x 1000.000 y 0.000 z 900.000 in"), std::string::npos) << lost;
}

TEST(GeneratedFlight, TableOf38IsTheUsualOneWithEveryFeatureInUse) {
  const auto usual = TankerModel::load("config/c12/tanker.csv", 0.0254, {190, 0, 95}).value(), all = TankerModel::load("config/c12/tanker38.csv", 0.0254, {190, 0, 95}).value();
  ASSERT_EQ(all.features().size(), 38U);
  ASSERT_EQ(usual.features().size(), 38U);
  int more = 0;
  for (std::size_t i = 0; i < 38; ++i) {
    const Feature &a = all.features()[i], &u = usual.features()[i];
    EXPECT_TRUE(a.enabled) << a.id;
    EXPECT_TRUE(a.id == u.id && a.name == u.name && a.p_m.xyz == u.p_m.xyz && a.normals_m == u.normals_m && a.sigma_m == u.sigma_m) << a.id;
    more += !u.enabled;
  }
  EXPECT_EQ(more, 9);
}

TEST(GeneratedFlight, FliesAllThirtyEightFeatures) {
  const test::TempDir dir;
  Scenario s = small_scenario();
  s.frames = 1;
  s.tanker = "config/c12/tanker38.csv";
  const Rig rig = Rig::load(fly(s, dir) + "/rig.toml").value();
  for (const Feature& f : rig.tanker.features()) EXPECT_TRUE(f.enabled) << f.id;
}

TEST(GeneratedFlight, TakesPicturesFromTheCacheAndDrawsThemAgainWhenTheyChange) {
  const test::TempDir dir;
  Scenario s = small_scenario();
  const auto rendered = [&](const char* name) {
    FlightOptions options;
    options.out = dir.file(name);
    options.threads = 2;
    return make_flight(s, options).value().rendered;
  };
  s.frames = 1;
  EXPECT_TRUE(rendered("first"));
  s.navigation.seed = 99;
  EXPECT_FALSE(rendered("other navigation"));
  s.look.light.sun_elevation_deg = 20;
  EXPECT_TRUE(rendered("other light"));
  s.look.light.sun_elevation_deg = Scenario::load("config/scenarios/embedded.toml")->look.light.sun_elevation_deg;
  std::filesystem::remove_all(dir.file("cache"));
  EXPECT_TRUE(rendered("cache removed"));
}

std::vector<Truth> truths(const std::string& folder) {
  std::vector<Truth> out;
  each_message(folder, [&](const record::LogEvent& e) {
    if (e.channel != channel::kTruth) return;
    EXPECT_TRUE(decode_truth(e.data.data(), e.data.size(), out.emplace_back()).ok());
  });
  return out;
}

TEST(GeneratedFlight, TruthIsWhatTheFrameWasDrawnFrom) {
  // GIVEN a flight with lens and windscreen, and the same scene once more
  const test::TempDir dir;
  Scenario s = small_scenario();
  s.windscreen = 1;
  s.camera.k1 = -0.05;
  const auto scene = FlightScene::load(s).value();
  const auto got = truths(fly(s, dir));
  ASSERT_EQ(got.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const Truth& t = got[static_cast<std::size_t>(i)];
    // THEN the pose gives the view, and the sun in camera axes is the scenario's
    const View view = scene->view(i);
    ASSERT_TRUE(t.has_pose && t.has_detail);
    EXPECT_LT((scene->camera_from_model(t.T_r_k, scene->true_place).translation().xyz - view.T_c_m.translation().xyz).norm(), 1e-9);
    EXPECT_LT((scene->camera_from_model(t.T_r_k, scene->true_place).rotation().matrix() - view.T_c_m.rotation().matrix()).norm(), 1e-12);
    EXPECT_EQ(t.exposure.ns, std::llround(s.exposure_us * 1e3));
    EXPECT_LT((view.R_n_c * t.sun_c - s.look.light.to_sun_n()).norm(), 1e-12);
    // AND each point says what the renderer says; its ideal pixel is the measured one without lens and windscreen
    std::vector<std::uint16_t> image;
    scene->renderer().render(view, image);
    std::map<int, FeatureTruth> drawn;
    for (const FeatureTruth& f : scene->renderer().truth(view, scene->model, &image)) drawn[f.id] = f;
    for (const TruthPoint& p : t.points) {
      EXPECT_EQ(p.reasons, drawn[p.id].reasons) << p.id;
      EXPECT_EQ(p.ideal_px, drawn[p.id].ideal_px) << p.id;
      if (scene->camera.inside(p.uv_px)) { EXPECT_LT((scene->camera.ideal_from_raw(p.uv_px) - p.ideal_px).norm(), 1e-3) << p.id; }
    }
  }
}

TEST(GeneratedFlight, ReasonsAccountForWhatIsScored) {
  const test::TempDir dir;
  constexpr std::uint32_t kNotSeen = kOutOfField | kFacesAway | kOccluded, kDoubtful = kAtBorder | kGrazing | kHalfHidden | kBlownOut;
  std::map<TruthVisibility, int> count;
  std::uint32_t all = 0;
  for (const Truth& t : truths(fly(small_scenario(), dir)))
    for (const TruthPoint& p : t.points) {
      ++count[p.visibility];
      all |= p.reasons;
      if (p.visibility == TruthVisibility::kVisible) { EXPECT_EQ(p.reasons & (kNotSeen | kDoubtful), 0u) << p.id; }
      if (p.visibility == TruthVisibility::kHidden) { EXPECT_NE(p.reasons & kNotSeen, 0u) << p.id; }
      if (p.visibility == TruthVisibility::kDoNotScore) { EXPECT_NE(p.reasons & kDoubtful, 0u) << p.id; }
    }
  EXPECT_GT(count[TruthVisibility::kVisible], 0);
  EXPECT_GT(count[TruthVisibility::kHidden], 0);
  EXPECT_NE(all & kInShadow, 0u);
}

}  // namespace
}  // namespace cyclops::hil
