#pragma once

#include <chrono>
#include <string>

#include "variolux/reconstruct/reconstruction.h"

namespace vlx {

/// Gives the time that passes to the stages of a report.
class StageClock {
  public:
    explicit StageClock(ReconstructionReport& report) : report_(report) {}

    /// The time since the last call (or construction) was `stage`'s.
    void addTo(const std::string& stage) {
        const auto now = std::chrono::steady_clock::now();
        report_.seconds[stage] += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }

  private:
    ReconstructionReport& report_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace vlx
