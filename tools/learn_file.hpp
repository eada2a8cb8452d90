#pragma once
/// The learnt model as files: features in the format of geometry/tanker_model.hpp, and what is known of their strength as JSON.
#include "tools/learn.hpp"

namespace cyclops::tools::learn {

enum class Mix {
  kReplace,  ///< the surveyed features stay in the file, switched off
  kAdd,      ///< the surveyed features stay as they are; learnt ones too near to one of them are left out
};

/// Units of the surveyed file. Ids of learnt features begin at the next thousand after the surveyed ones. Every value is written so
/// that it reads back the same.
[[nodiscard]] std::string model_csv(const Learnt& learnt, Mix mix, double apart_px);

/// Points with scatter, drift, sights and strength by flight and range.
[[nodiscard]] std::string strength_json(const Learnt& learnt);

/// Writes through a temporary name.
Result<> write_text(const std::string& path, const std::string& text);

}  // namespace cyclops::tools::learn
