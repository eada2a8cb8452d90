#pragma once
/// A CSV file with a header line: cells by column name, numbers checked, errors with file and line.
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops::tools {

class Csv {
 public:
  static Result<Csv> load(const std::string& path);
  [[nodiscard]] std::size_t rows() const { return rows_.size(); }
  [[nodiscard]] bool has(const std::string& column) const { return columns_.count(column) != 0; }
  /// The first of `names` that is a column; an error naming the file when none is.
  Result<std::string> one_of(const std::vector<std::string>& names) const;
  Result<double> number(std::size_t row, const std::string& column) const;
  Result<std::int64_t> whole(std::size_t row, const std::string& column) const;
  [[nodiscard]] std::string where(std::size_t row) const;

 private:
  std::string path_;
  std::map<std::string, std::size_t> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<int> line_;
};

}  // namespace cyclops::tools
