#pragma once
/// The part of export.hpp that draws.
#include "tools/export.hpp"

namespace cyclops::tools {

/// frames, pictures and video of the options; only those counts are filled in.
Result<Exported> export_pictures(const ExportOptions& options);

}  // namespace cyclops::tools
