#include "tools/csv.hpp"

#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

namespace cyclops::tools {
namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  std::string cell;
  while (std::getline(in, cell, ',')) {
    const auto a = cell.find_first_not_of(" \t\r");
    const auto b = cell.find_last_not_of(" \t\r");
    out.push_back(a == std::string::npos ? "" : cell.substr(a, b - a + 1));
  }
  if (!line.empty() && line.back() == ',') out.emplace_back();
  return out;
}

}  // namespace

Result<Csv> Csv::load(const std::string& path) {
  std::ifstream in(path);
  if (!in) return make_error(ErrorCode::kNotFound, path, "cannot be opened");
  Csv csv;
  csv.path_ = path;
  std::string line;
  int n = 0;
  std::size_t width = 0;
  while (std::getline(in, line)) {
    ++n;
    const auto row = cells(line);
    if (row.empty() || (row.size() == 1 && row[0].empty()) || row[0].rfind('#', 0) == 0) continue;
    if (csv.columns_.empty()) {
      width = row.size();
      for (std::size_t i = 0; i < width; ++i)
        if (!csv.columns_.emplace(row[i], i).second && !row[i].empty())
          return make_error(ErrorCode::kCorrupt, path + ":" + std::to_string(n), "column " + row[i] + " stands twice");
      continue;
    }
    if (row.size() != width)
      return make_error(ErrorCode::kCorrupt, path + ":" + std::to_string(n), "has " + std::to_string(row.size()) + " cells, expected " + std::to_string(width));
    csv.rows_.push_back(row);
    csv.line_.push_back(n);
  }
  if (csv.columns_.empty()) return make_error(ErrorCode::kTruncated, path, "holds no header line");
  return csv;
}

std::string Csv::where(std::size_t row) const { return path_ + ":" + std::to_string(line_[row]); }

Result<std::string> Csv::one_of(const std::vector<std::string>& names) const {
  std::string all;
  for (const std::string& n : names) {
    if (has(n)) return n;
    all += (all.empty() ? "" : " or ") + n;
  }
  return make_error(ErrorCode::kCorrupt, path_ + ":1", "header has no column " + all);
}

Result<double> Csv::number(std::size_t row, const std::string& column) const {
  const std::string& cell = rows_[row][columns_.at(column)];
  double v = 0;
  const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), v);
  if (code != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(v))
    return make_error(ErrorCode::kCorrupt, where(row), column + " is \"" + cell + "\", expected a finite number");
  return v;
}

Result<std::int64_t> Csv::whole(std::size_t row, const std::string& column) const {
  auto v = number(row, column);
  if (!v.ok()) return v.error();
  if (*v != std::floor(*v) || std::fabs(*v) > 1e15) return make_error(ErrorCode::kCorrupt, where(row), column + " is " + std::to_string(*v) + ", expected a whole number");
  return static_cast<std::int64_t>(*v);
}

}  // namespace cyclops::tools
