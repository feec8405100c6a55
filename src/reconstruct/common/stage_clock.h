#pragma once

#include <chrono>
#include <map>
#include <string>

namespace vlx {

/// Gives the time that passes to the stages of a report, in seconds.
class StageClock {
  public:
    explicit StageClock(std::map<std::string, double>& seconds) : seconds_(seconds) {}

    /// The time since the last call (or construction) was `stage`'s.
    void addTo(const std::string& stage) {
        const auto now = std::chrono::steady_clock::now();
        seconds_[stage] += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }

  private:
    std::map<std::string, double>& seconds_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace vlx
