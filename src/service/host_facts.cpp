#include "service/host_facts.hpp"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace cyclops {
namespace {

constexpr std::int64_t kEvery_ns = 1'000'000'000;
constexpr int kZones = 16;

struct Close {
  void operator()(std::FILE* f) const { std::fclose(f); }
  void operator()(DIR* d) const { ::closedir(d); }
};

double hottest_c() {
  double most = -1;
  for (int zone = 0; zone < kZones; ++zone) {
    char path[64];
    std::snprintf(path, sizeof path, "/sys/class/thermal/thermal_zone%d/temp", zone);
    const std::unique_ptr<std::FILE, Close> f(std::fopen(path, "r"));
    if (!f) break;
    int milli = 0;
    if (std::fscanf(f.get(), "%d", &milli) == 1) most = std::max(most, milli * 1e-3);
  }
  return most;
}

double resident_mb() {
  const std::unique_ptr<std::FILE, Close> f(std::fopen("/proc/self/statm", "r"));
  long size = 0, resident = 0;
  if (!f || std::fscanf(f.get(), "%ld %ld", &size, &resident) != 2) return -1;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) * 1e-6;
}

int descriptors() {
  const std::unique_ptr<DIR, Close> folder(::opendir("/proc/self/fd"));
  if (!folder) return -1;
  int n = 0;
  while (::readdir(folder.get()) != nullptr) ++n;
  return n - 3;  // "." and ".." and the folder itself
}

double cpu_s() {
  rusage u{};
  ::getrusage(RUSAGE_SELF, &u);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6; };
  return seconds(u.ru_utime) + seconds(u.ru_stime);
}

}  // namespace

const HostFacts& HostWatch::look(std::int64_t now_ns) {
  if (last_ns_ != 0 && now_ns - last_ns_ < kEvery_ns) return facts_;
  const double used = cpu_s();
  if (last_ns_ != 0) facts_.cpu_percent = 100 * (used - last_cpu_s_) / (static_cast<double>(now_ns - last_ns_) * 1e-9);
  last_cpu_s_ = used;
  last_ns_ = now_ns;
  double load[1] = {0};
  facts_.load = ::getloadavg(load, 1) == 1 ? load[0] : -1;
  facts_.temperature_c = hottest_c();
  facts_.memory_mb = resident_mb();
  facts_.open_files = descriptors();
  return facts_;
}

}  // namespace cyclops
