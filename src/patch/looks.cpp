#include "patch/looks.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "base/file.hpp"

namespace cyclops {
namespace {

constexpr const char* kMagic = "cyclops-looks-1";
constexpr const char* kColumns[] = {"id", "x", "y", "z", "light", "qw", "qx", "qy", "qz", "tx", "ty", "tz", "right_u", "right_v", "down_u", "down_v", "u", "v",
                                    "tried", "matched", "scatter", "anchor", "correlation", "pixels"};
constexpr std::size_t kCount = std::size(kColumns);
constexpr double kFarthest_m = 10'000, kMostPxPerM = 1e6, kStep_px = 4;
constexpr double kSamePlace_m = 1e-6;

std::string header() {
  std::string out;
  for (const char* c : kColumns) {
    if (!out.empty()) out += ',';
    out += c;
  }
  return out;
}

std::vector<std::string_view> split(std::string_view s, char at) {
  std::vector<std::string_view> out;
  for (std::size_t end = s.find(at); end != std::string_view::npos; end = s.find(at)) {
    out.push_back(s.substr(0, end));
    s.remove_prefix(end + 1);
  }
  out.push_back(s);
  return out;
}

/// One line; the first fault is kept.
class Row {
 public:
  Row(std::string_view line, std::string where) : fields_(split(line, ',')), where_(std::move(where)) {
    if (fields_.size() != kCount) error_ = make_error(ErrorCode::kCorrupt, where_, "has " + std::to_string(fields_.size()) + " fields, expected " + std::to_string(kCount));
  }
  double number(double low, double high) {
    double x = 0;
    const std::string_view t = text();
    const auto [end, code] = std::from_chars(t.data(), t.data() + t.size(), x);
    if (code != std::errc{} || end != t.data() + t.size() || !(x >= low && x <= high)) fail("a number from " + shortly(low) + " to " + shortly(high));
    return x;
  }
  int whole(int low, int high) {
    const double x = number(low, high);
    if (ok() && x != std::floor(x)) fail("a whole number");
    return ok() ? static_cast<int>(x) : low;
  }
  std::string name() {
    const std::string_view t = text();
    if (t.empty() || t.size() > 100 || !std::all_of(t.begin(), t.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' || c == '.'; }))
      fail("1 to 100 letters, digits, - _ .");
    return std::string(t);
  }
  template <std::size_t N>
  void pixels(std::array<float, N>& out) {
    const std::string_view t = text();
    if (t.size() != 2 * N) return fail(std::to_string(2 * N) + " hexadecimal digits");
    for (std::size_t i = 0; i < N; ++i) {
      int x = 0;
      const char* const at = t.data() + 2 * i;
      if (std::from_chars(at, at + 2, x, 16).ptr != at + 2 || *at == '-') return fail(std::to_string(2 * N) + " hexadecimal digits");
      out[i] = static_cast<float>(x);
    }
  }
  /// Of the field read last.
  void fail(const std::string& expected) {
    if (!ok()) return;
    const std::string_view t = next_ > 0 && next_ <= fields_.size() ? fields_[next_ - 1] : std::string_view{};
    error_ = make_error(ErrorCode::kCorrupt, where_, std::string(kColumns[next_ - 1]) + " is \"" + std::string(t.substr(0, 40)) + (t.size() > 40 ? "..." : "") + "\", expected " + expected);
  }
  [[nodiscard]] bool ok() const { return error_.ok(); }
  [[nodiscard]] const Result<>& error() const { return error_; }

 private:
  std::string_view text() { return next_ < fields_.size() ? fields_[next_++] : (++next_, std::string_view{}); }
  static std::string shortly(double x) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", x);
    return buffer;
  }
  std::vector<std::string_view> fields_;
  std::string where_;
  std::size_t next_{0};
  Result<> error_{Ok{}};
};

void read_pose(Row& row, StoredPatch& patch) {
  double q[4];
  Vec3 t;
  for (double& x : q) x = row.number(-1, 1);
  const Eigen::Quaterniond Q(q[0], q[1], q[2], q[3]);
  if (row.ok() && std::fabs(Q.norm() - 1) > 1e-6) row.fail("qw qx qy qz of length 1");
  for (int i = 0; i < 3; ++i) t[i] = row.number(-kFarthest_m, kFarthest_m);
  if (row.ok()) patch.T_c_k = {Rotation<frame::C, frame::K>(Q), Point<frame::C>(t)};
}

void read_steps(Row& row, StoredPatch& patch) {
  Mat2 px_per_m;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) px_per_m(j, i) = row.number(-kMostPxPerM, kMostPxPerM);
  const double scale = std::sqrt(std::fabs(px_per_m.determinant()));
  if (row.ok() && !(scale > 1e-3)) return row.fail("directions right and down that differ");
  patch.step_m = kStep_px / scale;
  patch.then_px = patch.step_m * px_per_m;
}

Look read_look(Row& row, const TankerModel& model) {
  Look l;
  l.id = row.whole(-1'000'000'000, 1'000'000'000);
  const auto& features = model.features();
  const auto f = std::find_if(features.begin(), features.end(), [&](const Feature& x) { return x.id == l.id; });
  if (f == features.end()) row.fail("a feature of the model");
  else l.feature = static_cast<std::size_t>(f - features.begin());
  for (int i = 0; i < 3; ++i) {
    l.p_k.xyz[i] = row.number(-kFarthest_m, kFarthest_m);
    if (row.ok() && std::fabs(l.p_k.xyz[i] - model.in_body(*f).xyz[i]) > kSamePlace_m) row.fail("the place of feature " + std::to_string(l.id) + " in the model");
  }
  l.light = row.name();
  read_pose(row, l.patch);
  if (row.ok() && !((l.patch.T_c_k * l.p_k).xyz.z() > 0)) row.fail("a pose with the feature before the camera");
  read_steps(row, l.patch);
  for (int i = 0; i < 2; ++i) l.patch.inside_px[i] = row.number(-6, 6);
  l.tried = row.whole(1, 1'000'000'000);
  l.matched = row.whole(1, l.tried);
  l.scatter_px = row.number(0, 10);
  l.anchor_px = row.number(0, 10);
  l.correlation = row.number(0, 1);
  row.pixels(l.patch.store);
  return l;
}

void put(std::string& out, double x) {
  char buffer[32];
  out.append(buffer, static_cast<std::size_t>(std::snprintf(buffer, sizeof buffer, "%.17g,", x)));
}

}  // namespace

Result<Looks> Looks::parse(const std::string& text, const std::string& name, const TankerModel& model) {
  if (text.empty() || text.back() != '\n') return make_error(ErrorCode::kTruncated, name, "does not end with a whole line, expected looks as cyclops-learn writes them");
  const std::vector<std::string_view> lines = split(std::string_view(text).substr(0, text.size() - 1), '\n');
  const auto where = [&](std::size_t i) { return name + ":" + std::to_string(i + 1); };
  if (lines[0] != kMagic) return make_error(ErrorCode::kCorrupt, where(0), "is \"" + std::string(lines[0].substr(0, 40)) + "\", expected \"" + kMagic + "\"");
  if (lines.size() < 2 || lines[1] != header()) return make_error(ErrorCode::kCorrupt, where(1), "is \"" + std::string(lines.size() < 2 ? "" : lines[1].substr(0, 40)) + "\", expected \"" + header() + "\"");
  Looks out;
  std::vector<std::size_t> of_feature(model.features().size(), 0);
  for (std::size_t i = 2; i < lines.size(); ++i) {
    Row row(lines[i], where(i));
    Look look = row.ok() ? read_look(row, model) : Look{};
    if (!row.ok()) return row.error().error();
    if (++of_feature[look.feature] > kMostOfFeature) return make_error(ErrorCode::kFull, where(i), "is look " + std::to_string(kMostOfFeature + 1) + " of feature " + std::to_string(look.id) + ", expected at most " + std::to_string(kMostOfFeature));
    out.items.push_back(std::move(look));
  }
  return out;
}

Result<Looks> Looks::load(const std::string& path, const TankerModel& model) {
  auto text = read_file(path);
  if (!text.ok()) return text.error();
  return parse(*text, path, model);
}

std::string Looks::text() const {
  std::string out = std::string(kMagic) + "\n" + header() + "\n";
  for (const Look& l : items) {
    out += std::to_string(l.id) + ",";
    for (double x : l.p_k.xyz) put(out, x);
    out += l.light + ",";
    const Eigen::Quaterniond q = l.patch.T_c_k.rotation().quaternion();
    for (double x : {q.w(), q.x(), q.y(), q.z()}) put(out, x);
    for (double x : l.patch.T_c_k.translation().xyz) put(out, x);
    const Mat2 px_per_m = l.patch.then_px / l.patch.step_m;
    for (double x : {px_per_m(0, 0), px_per_m(1, 0), px_per_m(0, 1), px_per_m(1, 1), l.patch.inside_px.x(), l.patch.inside_px.y()}) put(out, x);
    out += std::to_string(l.tried) + "," + std::to_string(l.matched) + ",";
    for (double x : {l.scatter_px, l.anchor_px, l.correlation}) put(out, x);
    for (float x : l.patch.store) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned>(std::clamp(std::lround(x), 0L, 255L)));
      out.append(digits, 2);
    }
    out += '\n';
  }
  return out;
}

}  // namespace cyclops
