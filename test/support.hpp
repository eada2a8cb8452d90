#pragma once
/// Shared by the tests: a folder that vanishes, a heap guard, a seeded generator.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

namespace cyclops::test {

/// A fresh folder below the system's temporary one, removed at the end of the scope.
class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Counts heap use of this thread while it lives: EXPECT_EQ(guard.count(), 0).
class HeapGuard {
 public:
  HeapGuard();
  [[nodiscard]] std::uint64_t count() const;

 private:
  std::uint64_t start_;
};

using Random = std::mt19937_64;

/// A file's bytes; empty when there is none.
inline std::string slurp(const std::string& path) {
  std::ostringstream out;
  out << std::ifstream(path, std::ios::binary).rdbuf();
  return out.str();
}
inline void spill(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

}  // namespace cyclops::test
