#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "variolux/dump/band.h"
#include "variolux/dump/format.h"
#include "variolux/dump/sample_source.h"

namespace vlx {

/// The motion of samples (kMotionChannels) to one of the neighbouring frames.
struct MotionReport {
    std::uint64_t samples = 0;
    std::uint64_t known = 0;
    std::uint64_t still = 0;    ///< of those, that do not move at all
    std::uint64_t leaving = 0;  ///< of those, that the other frame has outside the picture
    double median = 0;          ///< of the known lengths, in pixels, rounded down by less than 1 %
    double largest = 0;
};

/// One line for people.
std::string toText(const MotionReport& report);
/// Why this may not be motion in pixels; empty when nothing speaks against it.
std::string doubtOf(const MotionReport& report);

/// Measures motion while it is read.
class MotionCheck {
  public:
    explicit MotionCheck(const DumpHeader& header);
    /// The channels that add() wants; none where the dump does not have all four of motion.
    const std::vector<std::string>& channels() const { return channels_; }
    void add(const SampleBand& band);
    /// To the frame before, and to the next.
    std::array<MotionReport, 2> report() const;

  private:
    Window picture_;
    bool positions_ = false;  // of samples; without they count as taken at their pixels' centres
    std::vector<std::string> channels_;
    std::array<MotionReport, 2> counts_;
    std::array<std::vector<std::uint64_t>, 2> lengths_;  // how many, by the upper half of the bits of a float
};

}  // namespace vlx
