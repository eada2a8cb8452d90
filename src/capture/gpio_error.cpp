#include "capture/gpio_error.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace cyclops {

Error gpio_error(const std::string& where, const std::string& what, int number) {
  const bool absent = number == ENOENT || number == ENODEV || number == ENXIO || number == ENOTTY;
  std::string text = what + ": " + std::strerror(number);
  if (number == EBUSY) text += "; another program holds the line";
  if (number == EACCES || number == EPERM) text += "; this user may not open it (group gpio?)";
  return make_error(absent ? ErrorCode::kNotFound : ErrorCode::kIo, where, text);
}

Error no_chip(const std::string& chip, int number) {
  if (number == EACCES || number == EPERM) return gpio_error(chip, "GPIO chip", number);
  std::string have;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored))
    if (const std::string name = entry.path().filename().string(); name.starts_with("gpiochip")) have.append(" ").append(name);
  std::string text = "no GPIO chip of that label, name or path; this machine has";
  text += have.empty() ? " none" : have;
  return make_error(ErrorCode::kNotFound, chip, text);
}

}  // namespace cyclops
