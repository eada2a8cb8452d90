#include "hil/fault_host.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include <lcm/lcm.h>

#include "hil/dice.hpp"
#include "hil/fault_disk.hpp"
#include "hil/gige_device.hpp"

namespace cyclops::hil {
namespace {

constexpr std::int64_t kSlice_ns = 20'000'000;
constexpr std::size_t kSmall = 200, kLarge = 1 << 20;

void take_priority(int choice) {
  constexpr int kHigh = 1, kRealtime = 2;
  if (choice == kHigh) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), -10);
  const sched_param p{5};
  if (choice == kRealtime) (void)::sched_setscheduler(0, SCHED_FIFO, &p);
}

/// Busy for `share` of the time.
void burn(double share, const std::atomic<bool>& stop) {
  while (!stop) {
    const std::int64_t begin = monotonic_ns();
    while (!stop && static_cast<double>(monotonic_ns() - begin) < share * static_cast<double>(kSlice_ns)) {}
    sleep_until_ns(begin + kSlice_ns);
  }
}

std::vector<std::uint8_t> noise(std::size_t size, std::uint64_t seed) {
  std::vector<std::uint8_t> out(size);
  for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::uint8_t>(256 * dice(seed + i));
  return out;
}

}  // namespace

void prefer_this_thread() {
  const sched_param p{20};
  (void)::sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &p);
}

FaultHost::FaultHost(FaultPlayer& player, std::string lcm_url, std::function<std::vector<std::uint8_t>(const std::string&)> latest)
    : player_(player), lcm_url_(std::move(lcm_url)), latest_(std::move(latest)) {}

FaultHost::~FaultHost() {
  while (!works_.empty()) end(*works_.begin()->first);
}

Result<> FaultHost::begin(const Fault& fault) {
  auto work = std::make_unique<Work>();
  Result<> begun = Ok{};
  switch (fault.kind) {
    case FaultKind::kCpuLoad: begun = begin_cpu(fault, *work); break;
    case FaultKind::kFlood: begun = begin_flood(fault, *work); break;
    case FaultKind::kDiskSlow: begun = begin_slow(fault, *work); break;
    case FaultKind::kDiskFull: begun = begin_full(fault, *work); break;
    case FaultKind::kDiskReadOnly: begun = begin_read_only(fault, *work); break;
    default: return Ok{};
  }
  if (begun.ok()) works_[&fault] = std::move(work);
  return begun;
}

void FaultHost::end(const Fault& fault) {
  const auto found = works_.find(&fault);
  if (found == works_.end()) return;
  Work& work = *found->second;
  work.stop = true;
  for (std::thread& t : work.threads) t.join();
  if (work.undo) work.undo();
  works_.erase(found);
}

Result<> FaultHost::begin_cpu(const Fault& fault, Work& work) {
  for (int i = 0; i < static_cast<int>(fault.amount); ++i)
    work.threads.emplace_back([&fault, &work] {
      take_priority(fault.choice);
      burn(fault.share, work.stop);
    });
  player_.note(fault, work.threads.size());
  return Ok{};
}

Result<> FaultHost::begin_flood(const Fault& fault, Work& work) {
  work.threads.emplace_back([this, &fault, &work] { flood(fault, work); });
  return Ok{};
}

void FaultHost::flood(const Fault& fault, Work& work) {
  constexpr int kRepeat = 1, kBig = 2;
  lcm_t* lcm = lcm_create(lcm_url_.empty() ? nullptr : lcm_url_.c_str());
  if (lcm == nullptr) return;
  const std::vector<std::uint8_t> made_up = noise(fault.choice == kBig ? kLarge : kSmall, 1);
  const std::int64_t begin = monotonic_ns();
  std::uint64_t sent = 0;
  while (!work.stop) {
    const auto due = static_cast<std::uint64_t>(static_cast<double>(monotonic_ns() - begin) * 1e-9 * fault.amount);
    const std::vector<std::uint8_t> repeated = fault.choice == kRepeat ? latest_(fault.text) : std::vector<std::uint8_t>();
    const std::vector<std::uint8_t>& bytes = fault.choice == kRepeat ? repeated : made_up;
    for (; sent < due && !work.stop; ++sent)
      if (!bytes.empty()) lcm_publish(lcm, fault.text.c_str(), bytes.data(), static_cast<unsigned>(bytes.size()));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  player_.note(fault, sent);
  lcm_destroy(lcm);
}

Result<> FaultHost::begin_slow(const Fault& fault, Work& work) {
  CYCLOPS_TRY(disk::freeze(fault.text));
  work.threads.emplace_back([this, &fault, &work] {
    do {
      player_.note(fault);
      const std::int64_t until = monotonic_ns() + static_cast<std::int64_t>(fault.amount * 1e6);
      while (!work.stop && monotonic_ns() < until) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      disk::thaw(fault.text);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    } while (!work.stop && disk::freeze(fault.text).ok());
  });
  work.undo = [&fault] { disk::thaw(fault.text); };
  return Ok{};
}

Result<> FaultHost::begin_full(const Fault& fault, Work& work) {
  auto filled = disk::fill(fault.text);
  if (!filled.ok()) return filled.error();
  player_.note(fault, *filled);
  work.undo = [&fault] { disk::free(fault.text); };
  return Ok{};
}

Result<> FaultHost::begin_read_only(const Fault& fault, Work& work) {
  CYCLOPS_TRY(disk::make_read_only(fault.text));
  player_.note(fault);
  work.undo = [&fault] { disk::make_writable(fault.text); };
  return Ok{};
}

}  // namespace cyclops::hil
