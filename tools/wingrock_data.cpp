#include "tools/wingrock_data.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include <cyclops/measurement_set_t.hpp>

#include "geometry/earth.hpp"
#include "nav/relative.hpp"
#include "nav/tspi_buffer.hpp"
#include "record/flight.hpp"
#include "service/rig.hpp"
#include "wire/codec.hpp"

namespace cyclops::tools {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostReports = 2'000'000;

struct Points {
  std::int64_t gps_ns{0};            // 0: unknown
  std::int64_t service_ns{0};
  Shape shape;
};

Result<std::vector<Points>> read_points(const std::string& log, const Intrinsics& k) {
  auto in = record::EventLog::open(log);
  if (!in.ok()) return in.error();
  std::vector<Points> out;
  record::LogEvent event;
  measurement_set_t m;
  for (;;) {
    auto more = in->next(event);
    if (!more.ok()) return more.error();
    if (!*more) break;
    if (event.channel != channel::kMeasurement || m.decode(event.data.data(), 0, static_cast<int>(event.data.size())) < 0) continue;
    Points p{m.mid_exposure_gps_ns, m.mid_exposure_ns, {}};
    for (const measurement_t& z : m.items)
      if (z.accepted) p.shape.push_back({z.id, {(z.ideal_px[0] - k.cx_px) / k.fx_px, (z.ideal_px[1] - k.cy_px) / k.fy_px}});
    out.push_back(std::move(p));
  }
  if (out.empty()) return make_error(ErrorCode::kNotFound, log, "holds no MEASUREMENT");
  return out;
}

}  // namespace

struct WingRockData::State {
  explicit State(Rig r) : rig(std::move(r)), R_c_r(camera_from_receiver(rig.mount_angles)) {}
  Result<> read_tspi(FlightReader& flight);
  Result<> keep_frames(std::vector<Points> points);
  [[nodiscard]] Time at(double t_s) const { return Time{origin_ns + static_cast<std::int64_t>(t_s * 1e9)}; }

  Rig rig;
  Rotation<frame::C, frame::R> R_c_r;
  NavConfig nav{};
  TspiBuffer receiver{nav}, tanker{nav};          // on GPS time
  std::int64_t least_delay_ns{INT64_MAX};         // arrival on the service clock less GPS time
  std::int64_t origin_ns{0};                      // GPS time of the first frame
  bool by_arrival{false};
  std::vector<std::vector<Point<frame::K>>> features;   // of each frame kept
  std::vector<std::vector<int>> ids;
  std::optional<RollReference> reference;
  RollSeries seen;
};

Result<> WingRockData::State::read_tspi(FlightReader& flight) {
  std::vector<Tspi> reports;
  record::LogEvent event;
  for (;;) {
    auto more = flight.next(event);
    if (!more.ok()) return more.error();
    if (!*more) break;
    const bool from_receiver = event.channel == channel::kTspiReceiver;
    if (!from_receiver && event.channel != channel::kTspiTanker) continue;
    const auto r = decode_tspi(event.data.data(), event.data.size(), from_receiver ? Aircraft::kReceiver : Aircraft::kTanker);
    if (!r.ok()) continue;
    least_delay_ns = std::min(least_delay_ns, event.time_us * 1000 - r->t_gps.ns);
    reports.push_back(state_from_report(*r, Time{r->t_gps.ns}));
    if (reports.size() > kMostReports) return make_error(ErrorCode::kFull, flight.path("messages.lcm"), "more than " + std::to_string(kMostReports) + " TSPI messages");
  }
  receiver = tanker = TspiBuffer(nav, reports.size() + TspiBuffer::kHistory);
  for (const Tspi& t : reports) (t.aircraft == Aircraft::kReceiver ? receiver : tanker).push(t);
  if (receiver.size() < 2 || tanker.size() < 2) return make_error(ErrorCode::kNotFound, flight.path("messages.lcm"), "TSPI of both aircraft is needed");
  return Ok{};
}

Result<> WingRockData::State::keep_frames(std::vector<Points> points) {
  std::vector<Shape> shapes;
  for (const Points& p : points) shapes.push_back(p.shape);
  auto mean = RollReference::from(shapes);
  if (!mean.ok()) return Ok{};                     // nothing to read: no frame is kept
  reference = std::move(mean).value();
  for (const Points& p : points) {
    const auto reading = reference->roll(p.shape);
    if (!reading) continue;
    if (p.gps_ns == 0) by_arrival = true;
    const std::int64_t gps_ns = p.gps_ns != 0 ? p.gps_ns : p.service_ns - least_delay_ns;
    if (seen.t_s.empty()) origin_ns = gps_ns;
    const double t_s = static_cast<double>(gps_ns - origin_ns) * 1e-9;
    if (!seen.t_s.empty() && t_s <= seen.t_s.back()) continue;     // a log may hold a flight twice
    seen.t_s.push_back(t_s);
    seen.roll_rad.push_back(reading->roll_rad);
    std::vector<Point<frame::K>> where;
    std::vector<int> which;
    for (const ShapePoint& q : p.shape)
      for (const Feature& f : rig.tanker.features())
        if (f.id == q.feature) where.push_back(rig.tanker.in_body(f)), which.push_back(q.feature);
    features.push_back(std::move(where));
    ids.push_back(std::move(which));
  }
  return Ok{};
}

Result<std::unique_ptr<WingRockData>> WingRockData::load(const std::string& folder, const std::string& log) {
  auto flight = FlightReader::open(folder);
  if (!flight.ok()) return flight.error();
  auto rig = Rig::load(flight->path("rig.toml"));
  if (!rig.ok()) return rig.error();
  auto state = std::make_unique<State>(std::move(rig).value());
  CYCLOPS_TRY(state->read_tspi(*flight));
  auto points = read_points(log, state->rig.camera.intrinsics());
  if (!points.ok()) return points.error();
  CYCLOPS_TRY(state->keep_frames(std::move(points).value()));
  return std::unique_ptr<WingRockData>(new WingRockData(std::move(state)));
}

WingRockData::WingRockData(std::unique_ptr<State> state) : s_(std::move(state)) {}
WingRockData::~WingRockData() = default;
const RollSeries& WingRockData::seen() const { return s_->seen; }
bool WingRockData::by_arrival() const { return s_->by_arrival; }

double WingRockData::roll_at(std::size_t frame, double t_s) const {
  const State& s = *s_;
  const auto receiver = s.receiver.at(s.at(t_s)), tanker = s.tanker.at(s.at(t_s));
  if (receiver.kind != TspiBuffer::Kind::kInterpolated || tanker.kind != TspiBuffer::Kind::kInterpolated) return kNaN;
  const Pose<frame::R, frame::K> T_r_k = relative_state(receiver.state, tanker.state, s.rig.nav, 0, {}).T_r_k;
  Shape shape;
  shape.reserve(s.ids[frame].size());
  for (std::size_t f = 0; f < s.ids[frame].size(); ++f) {
    const Vec3 p = s.R_c_r.rotate(T_r_k * s.features[frame][f] - s.rig.lens);
    if (!(p.z() > 0)) return kNaN;
    shape.push_back({s.ids[frame][f], {p.x() / p.z(), p.y() / p.z()}});
  }
  const auto reading = s.reference->roll(shape);
  return reading ? reading->roll_rad : kNaN;
}

double WingRockData::bank_deg(bool tanker, double t_s) const {
  const auto a = (tanker ? s_->tanker : s_->receiver).at(s_->at(t_s));
  if (a.kind != TspiBuffer::Kind::kInterpolated) return kNaN;
  const Geodetic place = geodetic_from_ecef(a.state.position);
  const Mat3 R_n_b = level_axes(place.latitude_deg, place.longitude_deg).inverse().matrix() * a.state.q_e_b.toRotationMatrix();
  return heading_pitch_bank(R_n_b).bank / kDeg;
}

}  // namespace cyclops::tools
