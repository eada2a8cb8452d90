// sources: tools/csv.cpp src/base
// Any bytes as a table; every cell is asked for as a number.
#include <cmath>
#include <cstdlib>

#include "test/fuzz/memory_file.hpp"
#include "tools/csv.hpp"

using namespace cyclops;  // NOLINT

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file("table");
  const auto csv = tools::Csv::load(file.holding(data, size));
  if (!csv.ok()) {
    if (csv.error().message().empty()) std::abort();
    return 0;
  }
  const auto column = csv->one_of({"frame", "x_m", "x", "id", "a"});
  if (!column.ok()) return 0;
  for (std::size_t row = 0; row < csv->rows(); ++row) {
    const auto number = csv->number(row, *column);
    const auto whole = csv->whole(row, *column);
    if (number.ok() && !std::isfinite(*number)) std::abort();
    if (whole.ok() && (!number.ok() || static_cast<double>(*whole) != *number)) std::abort();
    if (!number.ok() && number.error().where != csv->where(row)) std::abort();
  }
  return 0;
}
