#include "base/result.hpp"

namespace cyclops {

const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalid: return "invalid";
    case ErrorCode::kNotFound: return "not found";
    case ErrorCode::kCorrupt: return "corrupt";
    case ErrorCode::kTruncated: return "truncated";
    case ErrorCode::kUnsupported: return "unsupported";
    case ErrorCode::kTimeout: return "timeout";
    case ErrorCode::kIo: return "input/output";
    case ErrorCode::kFull: return "full";
    case ErrorCode::kUnusable: return "unusable";
  }
  return "unknown";
}

}  // namespace cyclops
