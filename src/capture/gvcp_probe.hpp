#pragma once
/// Asks one address whether a GigE Vision device is there: unicast DISCOVERY, so that a missing camera is known within
/// `timeout` instead of the receiving library's 2.5 s. Blocks. Threads: any.
#include <string>

#include "base/result.hpp"
#include "base/time.hpp"

namespace cyclops {

struct CameraFound {
  std::string local_address;  ///< of the interface that reaches it
  std::string vendor;
  std::string model;
  std::string serial;
};

/// kNotFound: no answer. kInvalid: `address` is no IPv4 address. kCorrupt: something else answers there.
Result<CameraFound> probe_camera(const std::string& address, Duration timeout);

}  // namespace cyclops
