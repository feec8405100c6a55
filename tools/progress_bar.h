#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>

#include "variolux/base/progress.h"

namespace vlx {

/// One line that says how far a task is: label, bar, percent, time left. Redrawn in place at most ten times a
/// second, and only when `stream` is a terminal: nothing is written into a log file or a pipe. Erased when
/// the object goes. Safe to be told from several threads; must outlive the Progress made from it.
class ProgressBar {
  public:
    explicit ProgressBar(std::string label, std::FILE* stream = stderr);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// What library functions report to; empty when nothing is drawn.
    operator Progress();

  private:
    using Clock = std::chrono::steady_clock;
    void update(std::int64_t done, std::int64_t total);

    const std::string label_;
    std::FILE* const stream_;
    const bool terminal_;
    const Clock::time_point start_ = Clock::now();
    std::mutex mutex_;
    Clock::time_point drawn_;
    double fraction_ = 0;
    bool visible_ = false;
};

/// The text of the line, at most `columns` characters: `fraction` in [0, 1] is done after `seconds`.
std::string progressLine(const std::string& label, double fraction, double seconds, int columns);

/// "12 s", "3 min 05 s", "2 h 07 min".
std::string durationText(double seconds);

}  // namespace vlx
