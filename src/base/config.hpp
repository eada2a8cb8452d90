#pragma once
/// Reads TOML so that every key is read exactly once: a typo, a dead key and a wrong type all stop the start with
/// the file and line. Parsing is toml++; the bookkeeping is ours.
///
///   auto file = ConfigFile::load("config/default.toml");        // Result
///   ConfigTable nav = file->root().table("nav");
///   nav.read("update_every_n_frames", config.every_n);          // keeps the default when absent
///   nav.require("tanker", path);                                // an error when absent
///   Result<> ok = file->finish();                               // first error, else the first unread key
///
/// Errors are collected, not thrown: read on, then ask finish(). Threads: one at a time.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace cyclops {

class ConfigTable {
 public:
  struct Node;
  void read(const char* key, double& out);
  void read(const char* key, int& out);
  void read(const char* key, std::int64_t& out);
  void read(const char* key, bool& out);
  void read(const char* key, std::string& out);
  void read(const char* key, std::vector<double>& out);
  void read(const char* key, std::vector<std::string>& out);
  /// Three finite numbers below `largest` in size, into a V that is made as V{x, y, z} and read by [].
  template <class V>
  void read_three(const char* key, double largest, V& out) {
    std::vector<double> v{out[0], out[1], out[2]};
    read_three(key, largest, v);
    out = V{v[0], v[1], v[2]};
  }
  /// One of `names`; `out` becomes its index.
  void read_choice(const char* key, const std::vector<std::string>& names, int& out);
  template <class E>
  void read_enum(const char* key, const std::vector<std::string>& names, E& out) {
    int i = static_cast<int>(out);
    read_choice(key, names, i);
    out = static_cast<E>(i);
  }
  template <class T>
  void require(const char* key, T& out) {
    if (!has(key)) missing(key);
    read(key, out);
  }
  /// As read, and the value must lie in [low, high].
  void read_in(const char* key, double low, double high, double& out);
  void read_in(const char* key, int low, int high, int& out);

  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] ConfigTable table(const char* key);           ///< an empty table when absent
  [[nodiscard]] std::vector<ConfigTable> tables(const char* key);  ///< array of tables
  [[nodiscard]] std::string where(const char* key) const;     ///< "file:line: section.key"
  void fail(const char* key, const std::string& what);        ///< records an error at that key

 private:
  friend class ConfigFile;
  explicit ConfigTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  void missing(const char* key);
  void read_three(const char* key, double largest, std::vector<double>& out);
  std::shared_ptr<Node> node_;
};

class ConfigFile {
 public:
  struct State;
  [[nodiscard]] static Result<ConfigFile> load(const std::string& path);
  [[nodiscard]] static Result<ConfigFile> parse(const std::string& text, const std::string& name);
  [[nodiscard]] ConfigTable root() const;
  [[nodiscard]] Result<> finish() const;
  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] std::string resolve(const std::string& relative) const;  ///< against the file's own folder

 private:
  std::shared_ptr<State> state_;
};

}  // namespace cyclops
