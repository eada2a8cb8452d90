#pragma once
/// A value or the reason why there is none. No exception crosses a stage; see docs/architecture.md.
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace cyclops {

enum class ErrorCode {
  kInvalid,      ///< a value is outside what was expected
  kNotFound,     ///< a file, device, key or channel does not exist
  kCorrupt,      ///< bytes that do not decode
  kTruncated,    ///< bytes end too early
  kUnsupported,  ///< understood, but not something this build can do
  kTimeout,      ///< nothing came in the time allowed
  kIo,           ///< the operating system refused
  kFull,         ///< a bounded store has no room
  kUnusable,     ///< well formed, but its sender says not to use it
};

[[nodiscard]] const char* to_string(ErrorCode code);

/// What went wrong and where: `where` is "file:line", a channel, a key or a device; `what` has value and expectation.
struct Error {
  ErrorCode code{ErrorCode::kInvalid};
  std::string where;
  std::string what;
  [[nodiscard]] std::string message() const { return where.empty() ? what : where + ": " + what; }
};

/// Ends the program when a contract of the code itself is broken; active in every build.
#define CYCLOPS_ASSERT(condition)                                                                       \
  do {                                                                                                  \
    if (!(condition)) {                                                                                 \
      std::fprintf(stderr, "%s:%d: broken contract: %s\n", __FILE__, __LINE__, #condition);             \
      std::abort();                                                                                     \
    }                                                                                                   \
  } while (false)

struct Ok {};

template <class T = Ok>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT: a value is a result
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT
  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] T& value() & { CYCLOPS_ASSERT(ok()); return std::get<0>(state_); }
  [[nodiscard]] const T& value() const& { CYCLOPS_ASSERT(ok()); return std::get<0>(state_); }
  [[nodiscard]] T&& value() && { CYCLOPS_ASSERT(ok()); return std::get<0>(std::move(state_)); }
  [[nodiscard]] const Error& error() const { CYCLOPS_ASSERT(!ok()); return std::get<1>(state_); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, Error> state_;
};

inline Error make_error(ErrorCode code, std::string where, std::string what) {
  return Error{code, std::move(where), std::move(what)};
}

/// Passes an error on to the caller.
#define CYCLOPS_TRY(expression)                                          \
  do {                                                                   \
    if (auto cyclops_try_ = (expression); !cyclops_try_.ok())            \
      return cyclops_try_.error();                                       \
  } while (false)

}  // namespace cyclops
