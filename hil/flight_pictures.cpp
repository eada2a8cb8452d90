#include "hil/flight_pictures.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include <glib.h>

#include <cyclops/frame_index_t.hpp>
#include <cyclops/strobe_edge_t.hpp>
#include <cyclops/truth_t.hpp>

#include "base/file.hpp"
#include "hil/flight_figures.hpp"
#include "hil/flight_rig.hpp"
#include "record/flight.hpp"
#include "wire/encode.hpp"

namespace cyclops::hil {
namespace {

struct Frame {
  std::vector<std::uint16_t> pixels;
  std::vector<FeatureTruth> truth;
};

Frame drawn(const FlightScene& scene, int i) {
  Frame f;
  const View v = scene.view(i);
  scene.renderer().render(v, f.pixels);
  f.truth = scene.renderer().truth(v, scene.model, &f.pixels);
  return f;
}

static_assert(kOutOfField == truth_t::OUT_OF_FIELD && kFacesAway == truth_t::FACES_AWAY && kOccluded == truth_t::OCCLUDED && kInShadow == truth_t::IN_SHADOW &&
              kSaturated == truth_t::SATURATED && kAtBorder == truth_t::AT_BORDER && kGrazing == truth_t::GRAZING && kHalfHidden == truth_t::HALF_HIDDEN &&
              kBlownOut == truth_t::BLOWN_OUT);

Truth truth_of(const FlightScene& scene, int i, const std::vector<FeatureTruth>& features) {
  Truth t;
  t.camera_frame_id = static_cast<std::uint64_t>(i + 1);
  t.t_mid = {scene.mid_ns(i)};
  t.exposure = {to_ns(scene.scenario.exposure_us * 1e-6)};
  t.has_pose = true;
  t.T_r_k = relative(scene.motion.receiver(scene.mid_s(i)), scene.motion.tanker(scene.mid_s(i)));
  t.sun_c = scene.view(i).R_n_c.transpose() * scene.renderer().look().light.to_sun_n();
  t.has_detail = true;
  for (const FeatureTruth& f : features)
    if (f.in_front) t.points.push_back({f.id, f.raw_px, f.doubtful ? TruthVisibility::kDoNotScore : f.visible ? TruthVisibility::kVisible : TruthVisibility::kHidden, f.reasons, f.ideal_px});
  return t;
}

truth_t truth_message(const FlightScene& scene, int i, const std::vector<FeatureTruth>& features) {
  truth_t out;
  fill(out, truth_of(scene, i, features));
  return out;
}

class Sha256 {
 public:
  Sha256() : sum_(g_checksum_new(G_CHECKSUM_SHA256)) {}
  ~Sha256() { g_checksum_free(sum_); }
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  void add(const void* data, std::size_t bytes) { g_checksum_update(sum_, static_cast<const guchar*>(data), static_cast<gssize>(bytes)); }
  template <class T>
  void add(const T& number) { add(&number, sizeof number); }
  void add(const std::string& text) { add(text.data(), text.size()); }
  [[nodiscard]] std::string hex() const { return g_checksum_get_string(sum_); }

 private:
  GChecksum* sum_;
};

void add_poses(const FlightScene& scene, Sha256& sum) {
  sum.add(rig_toml(scene, {scene.true_place, 0, {}}));
  for (const Feature& f : scene.model.features()) sum.add(f.enabled);  // picture.json has the share that is searched
  for (int i = 0; i < scene.scenario.frames; ++i) {
    const View v = scene.view(i);
    sum.add(scene.mid_ns(i));
    sum.add(v.T_c_m.translation().xyz.data(), sizeof(Vec3));
    sum.add(v.T_c_m.rotation().quaternion().coeffs().data(), sizeof(Eigen::Vector4d));
  }
}

void add_mesh(const Mesh& mesh, Sha256& sum) {
  for (const Vec3& v : mesh.vertices_m) sum.add(v.data(), sizeof(Vec3));
  for (const Triangle& t : mesh.triangles) {
    sum.add(t.vertex);
    sum.add(t.material);
    for (const Vec3& n : t.normal) sum.add(n.data(), sizeof(Vec3));
  }
  for (const Material& m : mesh.materials) sum.add(m.albedo), sum.add(m.gloss), sum.add(m.shades);
  for (const Propeller& p : mesh.propellers) {
    sum.add(p.hub_m.data(), sizeof(Vec3));
    sum.add(p.axis.data(), sizeof(Vec3));
    for (double x : {p.radius_m, p.hub_radius_m, 1.0 * p.blades, p.blade_chord_m, p.rpm, 1.0 * p.albedo}) sum.add(x);
  }
}

/// The bindings stop compiling when a look grows a member.
void add_look(const Look& look, Sha256& sum) {
  const auto add = [&](auto... x) { (sum.add(static_cast<double>(x)), ...); };
  const auto& [light, sky, optics, sensor] = look;
  const auto& [sun_azimuth, sun_elevation, light_uniform] = light;
  add(sun_azimuth, sun_elevation, light_uniform);
  const auto& [cover, contrast, ground, ground_contrast, haze, sky_uniform] = sky;
  add(cover, contrast, ground, ground_contrast, haze, sky_uniform);
  const auto& [automatic, f_number, blur, glare, vignette, parallax] = optics;
  add(automatic, f_number, blur, glare, vignette, parallax);
  const auto& [exposure, responsivity, full_well, bits, gain, black, read_noise, photon_noise, prnu, transfer, blooming, dead] = sensor;
  add(exposure, responsivity, full_well, bits, gain, black, read_noise, photon_noise, prnu, transfer, blooming, dead);
}

/// Everything that pictures are made of, this program included: known without drawing.
std::string source_key(const FlightScene& scene) {
  Sha256 sum;
  add_poses(scene, sum);
  for (int i = 0; i < scene.scenario.frames; ++i) sum.add(scene.view(i).R_n_c.data(), sizeof(Mat3));
  add_mesh(scene.mesh, sum);
  for (const Feature& f : scene.model.features()) {
    sum.add(f.id);
    sum.add(f.p_m.xyz.data(), sizeof(Vec3));
    for (const Vec3& n : f.normals_m) sum.add(n.data(), sizeof(Vec3));
  }
  add_look(scene.scenario.look, sum);
  sum.add(scene.scenario.windscreen);
  sum.add(scene.scenario.seed);
  struct stat program {};
  if (::stat("/proc/self/exe", &program) == 0) sum.add(program.st_size), sum.add(program.st_mtim.tv_sec), sum.add(program.st_mtim.tv_nsec);
  return sum.hex().substr(0, 20);
}

std::string content_key(const FlightScene& scene) {
  Sha256 sum;
  add_poses(scene, sum);
  const int n = scene.scenario.frames;
  for (int i : {0, n / 2, n - 1}) {
    const Frame f = drawn(scene, i);
    sum.add(f.pixels.data(), f.pixels.size() * sizeof f.pixels[0]);
    const truth_t truth = truth_message(scene, i, f.truth);  // begins with the type's fingerprint
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(truth.getEncodedSize()));
    truth.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    sum.add(bytes.data(), bytes.size());
  }
  return sum.hex().substr(0, 20);
}

class Maker {
 public:
  Maker(const FlightScene& scene, const PictureOptions& options) : scene_(scene), s_(scene.scenario), options_(options), figures_(scene) {}

  Result<> write(const std::string& folder) {
    auto created = FlightWriter::create(folder, true);
    if (!created.ok()) return created.error();
    FlightWriter out = std::move(created).value();
    CYCLOPS_TRY(frames(out));
    CYCLOPS_TRY(queue_.write(out));
    CYCLOPS_TRY(out.text("rig.toml", rig_toml(scene_, {scene_.true_place, 0, {}})));
    CYCLOPS_TRY(out.text("picture.json", figures_.json().dump(1) + "\n"));
    if (!scene_.camera.windscreen().empty()) CYCLOPS_TRY(scene_.camera.windscreen().save(out.path("windscreen.bin")));
    return out.finish(flight_manifest(scene_, "pictures of a flight, without navigation"));
  }

 private:
  Result<> frames(FlightWriter& out) {
    const int batch = std::max(1, options_.threads);
    std::vector<Frame> frames(static_cast<std::size_t>(batch));
    for (int first = 0; first < s_.frames; first += batch) {
      if (options_.stop && options_.stop()) return make_error(ErrorCode::kUnusable, "scenario " + s_.name, "stopped at frame " + std::to_string(first + 1) + "; nothing is kept");
      const int n = std::min(batch, s_.frames - first);
      const auto work = [&](int k) { frames[static_cast<std::size_t>(k)] = drawn(scene_, first + k); };
      std::vector<std::thread> others;
      for (int k = 1; k < n; ++k) others.emplace_back(work, k);
      work(0);
      for (std::thread& t : others) t.join();
      for (int k = 0; k < n; ++k) CYCLOPS_TRY(say(out, first + k, frames[static_cast<std::size_t>(k)]));
      if (options_.progress) options_.progress(first + n, s_.frames);
    }
    return Ok{};
  }

  Result<> say(FlightWriter& out, int i, const Frame& drawn) {
    const std::int64_t start = to_ns(scene_.start_s(i)), exposure = to_ns(s_.exposure_us * 1e-6), arrival = kServiceStart_ns + start + exposure + to_ns(s_.readout_ms * 1e-3);
    const std::int64_t id = i + 1;  // a camera counts from 1
    FlightFrame frame;
    frame.camera_frame_id = static_cast<std::uint64_t>(id);
    frame.camera_tick_ns = kCameraStart_ns + to_ns(scene_.start_s(i) * (1 + s_.tick_drift_ppm * 1e-6));
    frame.exposure = Duration{exposure};
    frame.image = {reinterpret_cast<const std::uint8_t*>(drawn.pixels.data()), s_.camera.width, s_.camera.height, 2 * s_.camera.width, PixelFormat::kMono12};
    auto number = out.frame(Time{arrival}, frame);
    if (!number.ok()) return number.error();
    strobe_edge_t edge{};
    edge.service_time_ns = kServiceStart_ns + start;
    edge.line_seq = id;
    edge.edge = strobe_edge_t::RISING;
    queue_.add(edge.service_time_ns, "STROBE", edge);
    frame_index_t index{};
    index.seq = id;
    index.camera_frame_id = id;
    index.mid_exposure_ns = scene_.mid_ns(i);
    index.camera_tick_ns = frame.camera_tick_ns;
    index.arrival_ns = kServiceStart_ns + start + exposure + 1'000'000;
    index.exposure_ns = exposure;
    index.status = frame_index_t::COMPLETE;
    index.time_source = frame_index_t::TIME_STROBE;
    index.pixel_format = frame_index_t::MONO12;
    index.width_px = static_cast<std::int16_t>(s_.camera.width);
    index.height_px = static_cast<std::int16_t>(s_.camera.height);
    index.recorded_in = "frames.lcm";
    index.recorded_at = *number;
    queue_.add(arrival, "FRAME", index);
    queue_.add(arrival, "TRUTH", truth_message(scene_, i, drawn.truth));
    figures_.add(i, drawn.pixels, drawn.truth);
    return Ok{};
  }

  const FlightScene& scene_;
  const Scenario& s_;
  const PictureOptions& options_;
  PictureFigures figures_;
  ArrivalQueue queue_;
};

/// One process at a time draws into a cache; the others wait and find the pictures there.
class CacheLock {
 public:
  static Result<CacheLock> take(const std::string& cache) {
    std::error_code error;
    std::filesystem::create_directories(cache, error);
    if (error) return make_error(ErrorCode::kIo, cache, error.message());
    CacheLock t;
    const std::string path = cache + "/.lock";
    t.fd_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (t.fd_ < 0) return make_error(ErrorCode::kIo, path, std::strerror(errno));
    while (::flock(t.fd_, LOCK_EX) != 0)
      if (errno != EINTR) return make_error(ErrorCode::kIo, path, std::strerror(errno));
    return t;
  }
  ~CacheLock() { if (fd_ >= 0) ::close(fd_); }
  CacheLock(CacheLock&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  CacheLock& operator=(CacheLock&&) = delete;

 private:
  CacheLock() = default;
  int fd_{-1};
};

}  // namespace

Result<Pictures> make_pictures(const FlightScene& scene, const PictureOptions& options) {
  const std::filesystem::path cache(options.cache);
  const std::string note = (cache / ("." + source_key(scene))).string();
  Pictures out;
  if (const auto noted = read_file(note); noted.ok()) {
    out.folder = (cache / *noted).string();
    if (FlightReader::open(out.folder).ok()) return out;
  }
  const std::string name = scene.scenario.name + "-" + content_key(scene);
  out.folder = (cache / name).string();
  if (!FlightReader::open(out.folder).ok()) {
    const auto lock = CacheLock::take(options.cache);
    if (!lock.ok()) return lock.error();
    if (!FlightReader::open(out.folder).ok()) {
      const auto begin = std::chrono::steady_clock::now();
      CYCLOPS_TRY(Maker(scene, options).write(out.folder));
      out.rendered = true;
      out.render_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
  }
  GError* failed = nullptr;  // written beside it and renamed: whole or not there
  if (g_file_set_contents(note.c_str(), name.data(), static_cast<gssize>(name.size()), &failed) == FALSE) {
    const std::string why = failed->message;
    g_error_free(failed);
    return make_error(ErrorCode::kIo, note, why);
  }
  return out;
}

}  // namespace cyclops::hil
