#include "edit/motion_check.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "variolux/base/text.h"

namespace vlx {

namespace {

/// Floats of equal upper half differ by less than 1 %; in order, those that are not negative.
constexpr int kLowerBits = 16;

double shareOf(std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? 100 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

std::string toText(const MotionReport& report) {
    if (report.known == 0) return "known of no sample";
    return formatted("known of %.3g %% of the samples", shareOf(report.known, report.samples)) +
           formatted("; of those %.3g %% do not move", shareOf(report.still, report.known)) +
           formatted(", %.3g %% leave the picture", shareOf(report.leaving, report.known)) +
           formatted("; %.3g pixels (median)", report.median) + formatted(", %.3g (most)", report.largest);
}

std::string doubtOf(const MotionReport& report) {
    if (2 * report.known < report.samples) return "the motion of most samples is not known";
    if (2 * report.leaving > report.known)
        return "by their motion most samples leave the picture: it may not be in pixels";
    return "";
}

MotionCheck::MotionCheck(const DumpHeader& header) : picture_(header.display) {
    for (const std::string_view name : kMotionChannels)
        if (findChannel(header, name) < 0) return;
    channels_.assign(std::begin(kMotionChannels), std::end(kMotionChannels));
    positions_ = findChannel(header, "sample.x") >= 0 && findChannel(header, "sample.y") >= 0;
    if (positions_) channels_.insert(channels_.end(), {"sample.x", "sample.y"});
    for (auto& lengths : lengths_) lengths.resize(std::size_t{1} << (31 - kLowerBits));
}

void MotionCheck::add(const SampleBand& band) {
    if (channels_.empty()) return;
    const auto values = [&](std::string_view name) {
        return band.values[static_cast<std::size_t>(band.channel(name))].data();
    };
    const float* const xs = positions_ ? values("sample.x") : nullptr;
    const float* const ys = positions_ ? values("sample.y") : nullptr;
    const auto width = static_cast<std::size_t>(band.width);
    for (std::size_t k = 0; k < 2; ++k) {
        const float* const dx = values(kMotionChannels[2 * k]);
        const float* const dy = values(kMotionChannels[2 * k + 1]);
        MotionReport& counts = counts_[k];
        counts.samples += band.samples();
        for (std::size_t p = 0; p < band.pixels(); ++p) {
            const double column = band.x + static_cast<int>(p % width) + 0.5;
            const double row = band.y + static_cast<int>(p / width) + 0.5;
            for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
                const float length = std::hypot(dx[s], dy[s]);
                if (!std::isfinite(length)) continue;
                ++counts.known;
                counts.still += length == 0;
                counts.largest = std::max(counts.largest, static_cast<double>(length));
                ++lengths_[k][std::bit_cast<std::uint32_t>(length) >> kLowerBits];
                const double x = (positions_ ? xs[s] : column) + dx[s];
                const double y = (positions_ ? ys[s] : row) + dy[s];
                counts.leaving += !(x >= picture_.x && x < picture_.x + picture_.width && y >= picture_.y &&
                                    y < picture_.y + picture_.height);
            }
        }
    }
}

std::array<MotionReport, 2> MotionCheck::report() const {
    std::array<MotionReport, 2> reports = counts_;
    for (std::size_t k = 0; k < 2; ++k) {
        std::uint64_t below = 0;
        for (std::uint32_t i = 0; i < lengths_[k].size(); ++i) {
            below += lengths_[k][i];
            if (2 * below <= reports[k].known) continue;
            reports[k].median = std::bit_cast<float>(i << kLowerBits);
            break;
        }
    }
    return reports;
}

}  // namespace vlx
