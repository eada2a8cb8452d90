#pragma once
/// Races between ways of doing the same job, in one run: every repetition runs each of them once, so that load from elsewhere
/// falls on all alike; thread CPU time; medians, and the median of the ratios within a repetition.
///
///   BENCH(detect) {
///     bench::Race race("corner measure, full frame", 1024 * 1024, "ns/px", 1e-9);
///     race.add("cyclops", [&] { ... });            // the first is what the others are compared with
///     race.add("cornerHarris", [&] { ... });
///     race.run();                                  // prints the table
///   }
/// `build/bin/bench NAME...` runs the named ones, without names all of them.
#include <functional>
#include <string>
#include <vector>

namespace cyclops::bench {

/// CPU time of this thread, s.
[[nodiscard]] double thread_seconds();

class Race {
 public:
  /// Times are divided by `items` and shown in `unit`, which is `unit_s` seconds.
  Race(std::string title, double items, std::string unit, double unit_s);
  void add(std::string name, std::function<void()> job);
  void run(int repetitions = 15);

 private:
  struct Runner {
    std::string name;
    std::function<void()> job;
    std::vector<double> seconds;
  };
  std::string title_, unit_;
  double scale_;
  std::vector<Runner> runners_;
};

/// Keeps a result alive that nothing reads.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

struct Registered {
  Registered(const char* name, void (*run)());
};
#define BENCH(name)                                                      \
  static void bench_##name();                                            \
  static const ::cyclops::bench::Registered registered_##name{#name, bench_##name}; \
  static void bench_##name()

}  // namespace cyclops::bench
