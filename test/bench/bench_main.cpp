#include <malloc.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "test/bench/bench.hpp"

namespace cyclops::bench {
namespace {

std::vector<std::pair<const char*, void (*)()>>& registry() {
  static std::vector<std::pair<const char*, void (*)()>> all;
  return all;
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

}  // namespace

double thread_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Race::Race(std::string title, double items, std::string unit, double unit_s)
    : title_(std::move(title)), unit_(std::move(unit)), scale_(1 / (items * unit_s)) {}

void Race::add(std::string name, std::function<void()> job) { runners_.push_back({std::move(name), std::move(job), {}}); }

void Race::run(int repetitions) {
  constexpr double kLeast = 0.5e-3;  // s: shorter jobs are repeated within one measurement
  std::vector<int> rounds;
  for (Runner& r : runners_) {
    r.job();
    const double begin = thread_seconds();
    r.job();
    rounds.push_back(1 + static_cast<int>(kLeast / std::max(thread_seconds() - begin, 1e-7)));
  }
  for (int n = 0; n < repetitions; ++n)
    for (std::size_t i = 0; i < runners_.size(); ++i) {
      const double begin = thread_seconds();
      for (int k = 0; k < rounds[i]; ++k) runners_[i].job();
      runners_[i].seconds.push_back((thread_seconds() - begin) / rounds[i]);
    }
  std::printf("\n%-58s %10s %8s\n", title_.c_str(), unit_.c_str(), "ratio");
  for (const Runner& r : runners_) {
    std::vector<double> ratio;
    for (std::size_t n = 0; n < r.seconds.size(); ++n) ratio.push_back(r.seconds[n] / runners_[0].seconds[n]);
    std::printf("  %-56s %10.3f %8.2f\n", r.name.c_str(), median(r.seconds) * scale_, median(ratio));
  }
}

Registered::Registered(const char* name, void (*run)()) { registry().emplace_back(name, run); }

}  // namespace cyclops::bench

int main(int argc, char** argv) {
  // A heap that is given back to the system after every call makes peers that allocate up to 1.8 times slower.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  const auto wanted = [&](const char* name) {
    // `once...` are for callgrind, `scaling` has a target of its own: it takes a minute.
    if (argc < 2) return std::strncmp(name, "once", 4) != 0 && std::strcmp(name, "scaling") != 0;
    return std::any_of(argv + 1, argv + argc, [&](const char* a) { return std::strcmp(a, name) == 0; });
  };
  auto all = cyclops::bench::registry();
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return std::strcmp(a.first, b.first) < 0; });
  for (const auto& [name, run] : all)
    if (wanted(name)) run();
}
