#pragma once
/// Faults of the machine and its network: busy processors, floods on LCM, disks that stall, fill up or fail.
///
/// Every fault ends with end() or the destructor: busy threads stop, a frozen file system is thawed, the file that filled a
/// disk is removed. Only a disk that was made read-only stays so if its file system does not come back.
/// Threads  begin() and end() by one thread; work runs on threads inside.
/// Errors   kIo or kUnsupported with the folder, from begin(): no right to freeze, a file system that cannot be frozen.
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "hil/fault_player.hpp"

namespace cyclops::hil {

class FaultHost {
 public:
  /// `latest`: the last message sent on a channel, to be repeated by a flood; by any thread.
  FaultHost(FaultPlayer& player, std::string lcm_url, std::function<std::vector<std::uint8_t>(const std::string&)> latest);
  ~FaultHost();
  FaultHost(const FaultHost&) = delete;
  FaultHost& operator=(const FaultHost&) = delete;
  /// Other kinds than those of this class are none of its business.
  Result<> begin(const Fault& fault);
  void end(const Fault& fault);

 private:
  struct Work {
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    std::function<void()> undo;
  };
  Result<> begin_cpu(const Fault& fault, Work& work);
  Result<> begin_flood(const Fault& fault, Work& work);
  Result<> begin_slow(const Fault& fault, Work& work);
  Result<> begin_full(const Fault& fault, Work& work);
  Result<> begin_read_only(const Fault& fault, Work& work);
  void flood(const Fault& fault, Work& work);

  FaultPlayer& player_;
  std::string lcm_url_;
  std::function<std::vector<std::uint8_t>(const std::string&)> latest_;
  std::map<const Fault*, std::unique_ptr<Work>> works_;
};

/// Puts the calling thread before ordinary ones, so that what plays the fault does not suffer from it. Without the right: nothing.
void prefer_this_thread();

}  // namespace cyclops::hil
