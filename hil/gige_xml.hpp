#pragma once
/// The GenICam description a client reads from the device: names, types and ranges of the registers of gige_registers.hpp.
#include <string>

#include "hil/gige_config.hpp"

namespace cyclops::hil {

[[nodiscard]] std::string gige_xml(const GigeConfig& config);

}  // namespace cyclops::hil
