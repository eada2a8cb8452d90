#pragma once
/// The receiving library's C handles as owners, and its errors as ours. Only src/capture includes this.
#include <memory>
#include <string>

#include <arv.h>

#include "base/result.hpp"

namespace cyclops::arv {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Owner = std::unique_ptr<T, Unref>;

/// Receives a GError: pass `e.out()`, then ask failed().
class Fault {
 public:
  Fault() = default;
  Fault(const Fault&) = delete;
  Fault& operator=(const Fault&) = delete;
  ~Fault() { g_clear_error(&error_); }
  GError** out() { g_clear_error(&error_); return &error_; }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  [[nodiscard]] std::string text() const { return error_ != nullptr ? error_->message : "unknown reason"; }

 private:
  GError* error_{nullptr};
};

/// The library prints a line for each frame it gives up; ours is a counter. ARV_DEBUG in the environment still works.
void quiet();

}  // namespace cyclops::arv
