#include "geometry/tanker_model.hpp"

#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include <Eigen/Eigenvalues>

#include "base/file.hpp"

namespace cyclops {
namespace {

constexpr std::size_t kMost = 1024;  // msg/limits.hpp kMaxFeatures; geometry may not include msg
constexpr double kFarthest_m = 10'000, kMaxSigma_m = 10;

/// Splits one CSV line; a field in double quotes may hold commas, a doubled quote is one quote.
std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') { out.back() += '"'; ++i; }
    else if (c == '"') quoted = !quoted;
    else if (c == ',' && !quoted) out.emplace_back();
    else if (c != '\r') out.back() += c;
  }
  return out;
}

std::string trimmed(const std::string& s) {
  const auto a = s.find_first_not_of(" \t");
  return a == std::string::npos ? "" : s.substr(a, s.find_last_not_of(" \t") - a + 1);
}

bool number(const std::string& text, double& out) {
  const std::string t = trimmed(text);
  const auto [end, code] = std::from_chars(t.data(), t.data() + t.size(), out);
  return code == std::errc{} && end == t.data() + t.size() && std::isfinite(out);
}

bool parse_normals(const std::string& text, std::vector<Vec3>& out) {
  std::istringstream groups(text);
  std::string group;
  while (std::getline(groups, group, ';')) {
    std::istringstream words(group);
    Vec3 n;
    std::string extra;
    if (!(words >> n.x() >> n.y() >> n.z()) || (words >> extra) || !(n.norm() > 1e-6 && n.norm() < 1e6)) return false;
    out.push_back(n.normalized());
  }
  return true;
}

/// `n` numbers between blanks, nothing else.
bool numbers(const std::string& text, int n, double* out) {
  std::istringstream words(text);
  std::string word;
  int i = 0;
  while (words >> word)
    if (i == n || !number(word, out[i++])) return false;
  return i == n;
}

bool parse_covariance(const std::string& text, double unit, std::optional<Mat3>& out) {
  double c[6];
  if (!numbers(text, 6, c)) return false;
  Mat3 m;
  m << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  out = m * (unit * unit);
  return out->diagonal().maxCoeff() <= kMaxSigma_m * kMaxSigma_m && Eigen::SelfAdjointEigenSolver<Mat3>(*out, Eigen::EigenvaluesOnly).eigenvalues().minCoeff() >= 0;
}

bool parse_cone(const std::string& text, SeenFrom& out) {
  double c[4];
  if (!numbers(text, 4, c) || !(c[3] > 0 && c[3] <= 180)) return false;
  const Vec3 axis(c[0], c[1], c[2]);
  out.axis_m = axis.normalized();
  out.least_cosine = std::cos(c[3] * 3.14159265358979323846 / 180);
  return axis.norm() > 1e-6 && axis.norm() < 1e6;
}

bool parse_range(const std::string& text, double unit, SeenFrom& out) {
  double r[2];
  if (!numbers(text, 2, r)) return false;
  out.least_m = r[0] * unit;
  out.most_m = r[1] * unit;
  return 0 <= r[0] && r[0] < r[1];
}

class Columns {
 public:
  explicit Columns(const std::vector<std::string>& header) {
    for (std::size_t i = 0; i < header.size(); ++i) at_.emplace(trimmed(header[i]), i);
  }
  [[nodiscard]] const std::string* find(const std::vector<std::string>& row, std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (const auto it = at_.find(name); it != at_.end() && it->second < row.size()) return &row[it->second];
    return nullptr;
  }
  [[nodiscard]] bool has(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (at_.count(name) != 0) return true;
    return false;
  }

 private:
  std::map<std::string, std::size_t> at_;
};

}  // namespace

Point<frame::K> TankerModel::body_from_model(const Point<frame::M>& p) const {
  const Vec3 d = p - ins_;
  return {-d.x(), d.y(), -d.z()};
}

Mat3 TankerModel::covariance_in_camera(const Feature& f, const Mat3& R_c_k) {
  if (!f.cov_m2) return f.sigma_m * f.sigma_m * Mat3::Identity();
  const Mat3 R_c_m = R_c_k * Vec3(-1, 1, -1).asDiagonal();
  return R_c_m * *f.cov_m2 * R_c_m.transpose();
}

Result<TankerModel> TankerModel::parse(const std::string& csv, const std::string& name, double unit, const Vec3& ins_model, double sigma_m) {
  TankerModel model;
  model.ins_ = Point<frame::M>(ins_model * unit);
  std::istringstream lines(csv);
  std::string line;
  int line_no = 0;
  std::set<std::int32_t> seen;
  std::optional<Columns> columns;
  while (std::getline(lines, line)) {
    ++line_no;
    const std::string where = name + ":" + std::to_string(line_no);
    if (trimmed(line).empty() || trimmed(line)[0] == '#' || trimmed(line) == "\r") continue;
    const auto row = split(line);
    if (!columns) {
      columns.emplace(row);
      for (const char* need : {"id", "x", "y", "z"})
        if (!columns->has({need, (std::string(need) + "_m").c_str(), (std::string(need) + "_in").c_str()}))
          return make_error(ErrorCode::kCorrupt, where, "header has no column \"" + std::string(need) + "\", expected id, x, y, z");
      continue;
    }
    Feature f;
    f.sigma_m = sigma_m;
    double id = 0, sigma = 0;
    const auto* id_text = columns->find(row, {"id"});
    if (id_text == nullptr || !number(*id_text, id) || id != std::floor(id) || std::fabs(id) > 1e9)
      return make_error(ErrorCode::kCorrupt, where, "id is \"" + (id_text != nullptr ? *id_text : "") + "\", expected a whole number");
    f.id = static_cast<std::int32_t>(id);
    if (!seen.insert(f.id).second) return make_error(ErrorCode::kCorrupt, where, "id " + std::to_string(f.id) + " stands twice");
    const char* axes[3][3] = {{"x", "x_m", "x_in"}, {"y", "y_m", "y_in"}, {"z", "z_m", "z_in"}};
    for (int a = 0; a < 3; ++a) {
      const auto* text = columns->find(row, {axes[a][0], axes[a][1], axes[a][2]});
      double v = 0;
      if (text == nullptr || !number(*text, v))
        return make_error(ErrorCode::kCorrupt, where, std::string(axes[a][0]) + " is \"" + (text != nullptr ? *text : "") + "\", expected a finite number");
      f.p_m.xyz[a] = v * unit;
      if (std::fabs(f.p_m.xyz[a]) > kFarthest_m) return make_error(ErrorCode::kInvalid, where, std::string(axes[a][0]) + " is \"" + *text + "\", expected a place within 10 km");
    }
    if (const auto* t = columns->find(row, {"name", "label"})) f.name = trimmed(*t);
    if (const auto* t = columns->find(row, {"kind"})) f.kind = trimmed(*t);
    if (const auto* t = columns->find(row, {"normals"}); t != nullptr && !parse_normals(*t, f.normals_m))
      return make_error(ErrorCode::kCorrupt, where, "normals is \"" + *t + "\", expected \"nx ny nz; nx ny nz\"");
    if (const auto* t = columns->find(row, {"sigma", "sigma_m", "sigma_in"}); t != nullptr && !trimmed(*t).empty()) {
      if (!number(*t, sigma) || sigma < 0 || sigma * unit > kMaxSigma_m) return make_error(ErrorCode::kCorrupt, where, "sigma is \"" + *t + "\", expected a number from 0 to 10 m");
      f.sigma_m = sigma * unit;
    }
    const auto given = [&](const char* column) -> const std::string* {
      const auto* t = columns->find(row, {column});
      return t != nullptr && !trimmed(*t).empty() ? t : nullptr;
    };
    if (const auto* t = given("cov"); t != nullptr && !parse_covariance(*t, unit, f.cov_m2))
      return make_error(ErrorCode::kCorrupt, where, "cov is \"" + *t + "\", expected \"xx xy xz yy yz zz\" of a covariance");
    if (const auto* t = given("seen_from"); t != nullptr && !parse_cone(*t, f.seen_from.emplace()))
      return make_error(ErrorCode::kCorrupt, where, "seen_from is \"" + *t + "\", expected \"x y z deg\" with deg above 0, at most 180");
    if (const auto* t = given("seen_range"); t != nullptr && !parse_range(*t, unit, f.seen_from ? *f.seen_from : f.seen_from.emplace()))
      return make_error(ErrorCode::kCorrupt, where, "seen_range is \"" + *t + "\", expected \"least most\"");
    if (const auto* t = columns->find(row, {"enabled"}); t != nullptr && !trimmed(*t).empty()) {
      const std::string word = trimmed(*t);
      if (word != "0" && word != "1") return make_error(ErrorCode::kCorrupt, where, "enabled is \"" + *t + "\", expected 0 or 1");
      f.enabled = word == "1";
    }
    if (model.features_.size() == kMost) return make_error(ErrorCode::kFull, where, "more than 1024 features");
    model.features_.push_back(std::move(f));
  }
  if (model.features_.empty()) return make_error(ErrorCode::kTruncated, name, "holds no feature");
  return model;
}

Result<TankerModel> TankerModel::load(const std::string& path, double unit, const Vec3& ins_model, double sigma_m) {
  auto text = read_file(path);
  if (!text.ok()) return text.error();
  return parse(*text, path, unit, ins_model, sigma_m);
}

}  // namespace cyclops
