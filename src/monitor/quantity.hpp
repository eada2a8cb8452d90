#pragma once
/// What an alarm can watch: the numbers of HEALTH, by the names they have there.
///
/// Unit     as in the file of limits; empty for flags, shares, numbers and `time_source`.
/// Unknown  is NaN: fields that say -1 for "unknown" or "not there".
/// Threads  any.
#include <cyclops/health_t.hpp>
#include <span>
#include <string_view>

namespace cyclops {

struct Quantity {
  const char* name;
  const char* unit;
  double (*of)(const health_t&);
};

[[nodiscard]] std::span<const Quantity> quantities();
/// Null when there is none of that name.
[[nodiscard]] const Quantity* find_quantity(std::string_view name);

}  // namespace cyclops
