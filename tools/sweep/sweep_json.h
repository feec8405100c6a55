#pragma once

#include <nlohmann/json.hpp>

#include "sweep/sweep.h"
#include "variolux/compare/statistics.h"

namespace vlx {

/// A number, or null when it is not finite.
inline nlohmann::ordered_json numberJson(double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json toJson(const Reliability& reliability);

}  // namespace vlx
