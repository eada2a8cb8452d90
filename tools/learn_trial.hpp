#pragma once
/// A model on a flight with truth: what its measurements and its poses are worth.
///
/// A measurement is judged against its feature's place in the model, seen from the true pose (tools/true_pose.hpp): the error holds that
/// of the place and that of the corner. Nothing tells whether a learnt point is really visible, so only what was measured counts.
/// Poses: distance of the lens from its true place in tanker body axes, which boresight does not change.
#include <nlohmann/json.hpp>

#include "tools/learn_views.hpp"

namespace cyclops::tools::learn {

/// `tanker`: model file, or empty for the flight's own. `looks`: of its features, or empty.
Result<nlohmann::json> try_model(const Stretch& flight, const std::string& tanker, const std::string& looks, const Profile& profile);

/// One line for people.
[[nodiscard]] std::string trial_line(const nlohmann::json& figures);

}  // namespace cyclops::tools::learn
