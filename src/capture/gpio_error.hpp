#pragma once
/// What is common to the ways of reading a GPIO line: its errors in words, and the name the kernel shows for who holds it.
#include <string>

#include "base/result.hpp"

namespace cyclops {

inline constexpr char kGpioConsumer[] = "cyclops";

/// `number` is an errno. kNotFound for what is not there, else kIo, with the usual reasons.
[[nodiscard]] Error gpio_error(const std::string& where, const std::string& what, int number);
/// No chip of that label, name or path; says which ones there are.
[[nodiscard]] Error no_chip(const std::string& chip, int number);

}  // namespace cyclops
