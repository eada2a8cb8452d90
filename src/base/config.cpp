#include "base/config.hpp"

#include <stdexcept>

// toml++ asserts where a file is merely wrong, e.g. "[(a]": an error for us, not the end of the program.
namespace {
struct TomlAssertion : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] void toml_assertion(const char* condition) { throw TomlAssertion(condition); }
}  // namespace
#define TOML_ASSERT(condition) ((condition) ? static_cast<void>(0) : toml_assertion(#condition))
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "base/config_text.hpp"
#include "base/file.hpp"

namespace cyclops {

struct ConfigFile::State {
  std::string name;
  toml::table root;
  std::shared_ptr<ConfigTable::Node> root_node;
  std::vector<Error> errors;
};

struct ConfigTable::Node {
  ConfigFile::State* file{nullptr};
  toml::table* table{nullptr};  // null: the table is absent, everything reads as its default
  std::string path;
  std::set<std::string> used;
  std::vector<std::shared_ptr<Node>> children;

  [[nodiscard]] std::string full(const char* key) const { return path.empty() ? key : path + "." + key; }
  [[nodiscard]] std::string at(const toml::node* node, const char* key) const {
    const auto line = node != nullptr ? node->source().begin.line : (table != nullptr ? table->source().begin.line : 0);
    return file->name + ":" + std::to_string(line) + ": " + full(key);
  }
  toml::node* take(const char* key) {
    if (table == nullptr) return nullptr;
    toml::node* node = table->get(key);
    if (node != nullptr && !used.insert(key).second)
      file->errors.push_back(make_error(ErrorCode::kInvalid, at(node, key), "key is read twice (defect in the program)"));
    return node;
  }
  void error(const toml::node* node, const char* key, std::string what) {
    file->errors.push_back(make_error(ErrorCode::kInvalid, at(node, key), std::move(what)));
  }
  void unread(std::vector<Error>& out) const {
    if (table == nullptr) return;
    for (auto&& [key, node] : *table)
      if (used.count(std::string(key.str())) == 0)
        out.push_back(make_error(ErrorCode::kInvalid, at(&node, std::string(key.str()).c_str()), "unknown key"));
    for (const auto& child : children) child->unread(out);
  }
};

namespace {

/// The first line up to which the text already lets toml++ assert.
int line_of_assertion(const std::string& text) {
  int line = 1;
  for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', end + 1), ++line) {
    try {
      (void)toml::parse(std::string_view(text).substr(0, end));
    } catch (const toml::parse_error&) {  // only cut short
    } catch (const TomlAssertion&) {
      return line;
    }
  }
  return line;
}

/// Numbers as short as they can be read back. A list is taken apart: toml++ 3.3 counts the digits of a number below 1 in it by its
/// logarithm, as an unsigned number.
std::string shown(const toml::node& node) {
  constexpr std::size_t kMost = 8;
  if (node.is_table()) return "a table";
  if (const toml::value<double>* number = node.as_floating_point()) {
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), number->get()).ptr};
  }
  if (const toml::array* list = node.as_array()) {
    std::string text;
    for (std::size_t i = 0; i < std::min(kMost, list->size()); ++i) text += (i == 0 ? "" : ", ") + shown((*list)[i]);
    return "[" + text + (list->size() > kMost ? ", ...]" : "]");
  }
  std::ostringstream out;
  node.visit([&](auto&& n) { out << n; });
  return out.str();
}

}  // namespace

bool ConfigTable::has(const char* key) const { return node_->table != nullptr && node_->table->contains(key); }

std::string ConfigTable::where(const char* key) const {
  return node_->at(node_->table != nullptr ? node_->table->get(key) : nullptr, key);
}

void ConfigTable::fail(const char* key, const std::string& what) {
  node_->error(node_->table != nullptr ? node_->table->get(key) : nullptr, key, what);
}

void ConfigTable::missing(const char* key) { fail(key, "required key is missing"); }

void ConfigTable::read(const char* key, double& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  if (auto v = node->value<double>(); v && (node->is_floating_point() || node->is_integer())) out = *v;
  else node_->error(node, key, "is " + shown(*node) + ", expected a number");
}

void ConfigTable::read(const char* key, std::int64_t& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  if (node->is_integer()) out = *node->value<std::int64_t>();
  else node_->error(node, key, "is " + shown(*node) + ", expected a whole number");
}

void ConfigTable::read(const char* key, int& out) {
  std::int64_t wide = out;
  read(key, wide);
  if (wide < INT32_MIN || wide > INT32_MAX) fail(key, "is " + std::to_string(wide) + ", expected a 32-bit number");
  else out = static_cast<int>(wide);
}

void ConfigTable::read(const char* key, bool& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  if (node->is_boolean()) out = *node->value<bool>();
  else node_->error(node, key, "is " + shown(*node) + ", expected true or false");
}

void ConfigTable::read(const char* key, std::string& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  if (node->is_string()) out = *node->value<std::string>();
  else node_->error(node, key, "is " + shown(*node) + ", expected a string");
}

void ConfigTable::read(const char* key, std::vector<double>& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  std::vector<double> values;
  bool good = array != nullptr;
  if (good)
    for (const toml::node& item : *array) {
      const auto v = item.value<double>();
      good = good && v && (item.is_floating_point() || item.is_integer());
      if (good) values.push_back(*v);
    }
  if (good) out = std::move(values);
  else node_->error(node, key, "is " + shown(*node) + ", expected a list of numbers");
}

void ConfigTable::read(const char* key, std::vector<std::string>& out) {
  toml::node* node = node_->take(key);
  if (node == nullptr) return;
  const toml::array* array = node->as_array();
  std::vector<std::string> values;
  bool good = array != nullptr;
  if (good)
    for (const toml::node& item : *array) {
      good = good && item.is_string();
      if (good) values.push_back(*item.value<std::string>());
    }
  if (good) out = std::move(values);
  else node_->error(node, key, "is " + shown(*node) + ", expected a list of strings");
}

void ConfigTable::read_three(const char* key, double largest, std::vector<double>& out) {
  std::vector<double> v = out;
  read(key, v);
  if (v.size() == 3 && std::all_of(v.begin(), v.end(), [&](double x) { return std::fabs(x) < largest; })) {
    out = v;
    return;
  }
  fail(key, "expected three numbers below " + std::to_string(static_cast<std::int64_t>(largest)));
}

void ConfigTable::read_choice(const char* key, const std::vector<std::string>& names, int& out) {
  if (!has(key)) { node_->used.insert(key); return; }
  std::string word;
  const std::size_t before = node_->file->errors.size();
  read(key, word);
  if (node_->file->errors.size() != before) return;
  std::string all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == word) { out = static_cast<int>(i); return; }
    all += (i != 0 ? ", " : "") + names[i];
  }
  fail(key, "is \"" + word + "\", expected one of: " + all);
}

void ConfigTable::read_in(const char* key, double low, double high, double& out) {
  double v = out;
  read(key, v);
  if (v >= low && v <= high) { out = v; return; }
  std::ostringstream what;
  what << "is " << v << ", expected " << low << " to " << high;
  fail(key, what.str());
}

void ConfigTable::read_in(const char* key, int low, int high, int& out) {
  int v = out;
  read(key, v);
  if (v >= low && v <= high) { out = v; return; }
  fail(key, "is " + std::to_string(v) + ", expected " + std::to_string(low) + " to " + std::to_string(high));
}

ConfigTable ConfigTable::table(const char* key) {
  auto child = std::make_shared<Node>();
  child->file = node_->file;
  child->path = node_->full(key);
  if (toml::node* node = node_->take(key); node != nullptr) {
    child->table = node->as_table();
    if (child->table == nullptr) node_->error(node, key, "is " + shown(*node) + ", expected a table");
  }
  node_->children.push_back(child);
  return ConfigTable(child);
}

std::vector<ConfigTable> ConfigTable::tables(const char* key) {
  std::vector<ConfigTable> out;
  toml::node* node = node_->take(key);
  if (node == nullptr) return out;
  toml::array* array = node->as_array();
  if (array == nullptr) { node_->error(node, key, "expected an array of tables"); return out; }
  for (std::size_t i = 0; i < array->size(); ++i) {
    auto child = std::make_shared<Node>();
    child->file = node_->file;
    child->path = node_->full(key) + "[" + std::to_string(i) + "]";
    child->table = array->get(i)->as_table();
    if (child->table == nullptr) node_->error(node, key, "expected an array of tables");
    node_->children.push_back(child);
    out.push_back(ConfigTable(child));
  }
  return out;
}

Result<ConfigFile> ConfigFile::parse(const std::string& original, const std::string& name) {
  const auto ascii = ascii_text(original, name);
  if (!ascii.ok()) return ascii.error();
  const std::string& text = *ascii;
  ConfigFile file;
  file.state_ = std::make_shared<State>();
  file.state_->name = name;
  try {
    file.state_->root = toml::parse(text, name);
  } catch (const toml::parse_error& e) {
    return make_error(ErrorCode::kCorrupt, name + ":" + std::to_string(e.source().begin.line), std::string(e.description()));
  } catch (const TomlAssertion&) {
    return make_error(ErrorCode::kCorrupt, name + ":" + std::to_string(line_of_assertion(text)), "cannot be understood: expected key = value or [table]");
  }
  file.state_->root_node = std::make_shared<ConfigTable::Node>();
  file.state_->root_node->file = file.state_.get();
  file.state_->root_node->table = &file.state_->root;
  return file;
}

Result<ConfigFile> ConfigFile::load(const std::string& path) {
  auto text = read_file(path);
  if (!text.ok()) return text.error();
  return parse(*text, path);
}

ConfigTable ConfigFile::root() const { return ConfigTable(state_->root_node); }

Result<> ConfigFile::finish() const {
  if (!state_->errors.empty()) return state_->errors.front();
  std::vector<Error> unread;
  state_->root_node->unread(unread);
  if (!unread.empty()) return unread.front();
  return Ok{};
}

const std::string& ConfigFile::name() const { return state_->name; }

std::string ConfigFile::resolve(const std::string& relative) const {
  const std::filesystem::path p(relative);
  if (p.is_absolute()) return relative;
  return (std::filesystem::path(state_->name).parent_path() / p).string();
}

}  // namespace cyclops
