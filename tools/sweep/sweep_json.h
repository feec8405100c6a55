#pragma once

#include <nlohmann/json.hpp>

#include "page/page.h"
#include "sweep/sweep.h"

namespace vlx {

nlohmann::ordered_json toJson(const Reliability& reliability);

}  // namespace vlx
