#include "reconstruct/drift/light.h"

#include <algorithm>

#include "reconstruct/common/window_sum.h"
#include "reconstruct/drift/stacking.h"

namespace vlx {

Light::Row::Row(int width) {
    for (auto* planes : {value, deviation, missing, lost})
        for (int c = 0; c < 3; ++c) planes[c].resize(static_cast<std::size_t>(width));
}

void Light::sumRow(int y, const Row& row) {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<float> squares(w), lost(w), all(w), light(w), room(w);
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < w; ++i) {
            squares[i] += row.missing[c][i] * row.missing[c][i];
            lost[i] += row.lost[c][i] * row.lost[c][i];
            all[i] += row.lost[c][i];
            light[i] += std::max(0.f, row.value[c][i]) + row.lost[c][i];
            room[i] = static_cast<float>(Light::room(row.value[c][i], row.deviation[c][i]));
        }
        for (const auto& [window, reach] : {std::pair{0, LightReach::kNear}, {1, LightReach::kWide}}) {
            sumAround(row.missing[c], reach, false, sums_.row(LightPlanes::missing(window) + c, y));
            sumAround(room, reach, false, sums_.row(LightPlanes::room(window) + c, y));
        }
    }
    sumAround(squares, LightReach::kNear, true, sums_.row(LightPlanes::square(0), y));
    sumAround(squares, LightReach::kWide, true, sums_.row(LightPlanes::square(1), y));
    sumAround(lost, LightReach::kNear, true, sums_.row(LightPlanes::kLost, y));
    sumAround(light, LightReach::kNear, false, sums_.row(LightPlanes::kLight, y));
    sumAround(all, LightReach::kNear, false, sums_.row(LightPlanes::kAllLost, y));
    sumAround(std::vector<float>(w, 1.f), LightReach::kNear, false, sums_.row(LightPlanes::kPixels, y));
}

Light::Shares Light::shares(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<double> sums(LightPlanes::kChannels * w);
    for (int row = std::max(0, y - LightReach::kNear); row <= std::min(height_ - 1, y + LightReach::kNear);
         ++row) {
        const auto g = static_cast<double>(windowWeight(row - y, LightReach::kNear));
        for (int k = 0; k < LightPlanes::kChannels; ++k) {
            addScaled(sums_.row(k, row), LightPlanes::isSquare(k) ? g * g : g, w,
                      sums.data() + static_cast<std::size_t>(k) * w);
        }
    }
    Shares result;
    for (auto& plane : result.moved) plane.resize(w);
    result.lost.resize(w);
    result.lostLevel.resize(w);
    for (std::size_t i = 0; i < w; ++i) {
        const auto at = [&](int plane) { return sums[static_cast<std::size_t>(plane) * w + i]; };
        double moved[3] = {};
        for (const int window : {1, 0}) {
            double apart = 0, missing[3];
            for (int c = 0; c < 3; ++c) {
                missing[c] =
                    at(LightPlanes::missing(window) + c) - moved[c] * at(LightPlanes::room(window) + c);
                apart += missing[c] * missing[c];
            }
            const double known = shrinkage(apart, at(LightPlanes::square(window)));
            for (int c = 0; c < 3; ++c) {
                const double room = at(LightPlanes::room(window) + c);
                if (room > 0) moved[c] += known * missing[c] / room;
            }
        }
        for (int c = 0; c < 3; ++c) result.moved[c][i] = moved[c];
        const double light = at(LightPlanes::kLight);
        if (light > 0) result.lost[i] = at(LightPlanes::kLost) / (light * light);
        result.lostLevel[i] = at(LightPlanes::kAllLost) / at(LightPlanes::kPixels) / 3;
    }
    return result;
}

}  // namespace vlx
